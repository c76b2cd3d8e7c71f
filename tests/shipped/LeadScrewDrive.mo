within ;
model LeadScrewDrive "Vertical screw drive: speed loop, motor, screw, carriage with a payload"
  THSA.Interfaces.RealInput w_ref(unit="rad/s") "Reference of the motor's speed";
  THSA.Interfaces.RealOutput w(unit="rad/s", nominal=10) "Speed of the motor";
  THSA.Interfaces.RealOutput i(unit="A", nominal=1) "Current of the q axis";
  parameter THSA.Units.TorqueConstant K_t(min=1e-6, max=1e3) = 0.3 "Torque constant";
  parameter THSA.Units.Inertia J(min=1e-9, max=1e3) = 4e-4 "Inertia of rotor, coupling and screw";
  parameter THSA.Units.Torque T_c(min=0, max=1e3) = 0.05 "Coulomb friction torque";
  parameter Real b(unit="N.m.s/rad", min=0, max=1e3) = 5e-4 "Viscous friction coefficient";
  parameter THSA.Units.Mass m(min=0, max=1e4) = 50 "Mass of carriage and payload";
  parameter THSA.Units.Length P_h(min=1e-5, max=1) = 5e-3 "Lead";
  parameter Real k_p(unit="A.s/rad") = 0.1 "Gain of the speed loop";
  parameter Real k_i(unit="A/rad") = 2 "Integral gain of the speed loop";
  final parameter Real k(unit="m/rad") = P_h/(2*3.141592653589793) "Travel per angle";
  THSA.Friction friction(v(unit="rad/s"), F_C(unit="N.m"), b_v(unit="N.m.s/rad"), F_f(unit="N.m"),
    b_q(unit="N.m.s2/rad2", min=-1e3, max=1e3), v_S(unit="rad/s", max=1e3) = 0.1, v_r(unit="rad/s", max=1) = 1e-3) "Friction";
  replaceable THSA.Effects.ConstantTorqueConstant torqueEffect constrainedby THSA.Interfaces.TorqueConstantEffect
    "Slot: torque constant";
  replaceable THSA.Effects.NoFriction motorEffect(v(unit="rad/s"), z(unit="rad"), N(unit="N.m"), F(unit="N.m"))
    constrainedby THSA.Interfaces.FrictionEffect "Slot: friction and torques of the motor";
  replaceable THSA.Effects.NoFriction screwEffect(v(unit="rad/s"), z(unit="rad"), N(unit="N.m"), F(unit="N.m"))
    constrainedby THSA.Interfaces.FrictionEffect "Slot: thread, as a torque at the motor";
  Real phi(unit="rad", nominal=10, start=0, fixed=true) "Angle of the motor";
  Real omega(unit="rad/s", nominal=10, start=0, fixed=true) "Speed of the motor";
  Real x(unit="A", start=0, fixed=true) "Integral part";
  Real tau_m(unit="N.m") "Torque of the motor";
  Real tau_n(unit="N.m") "Axial force on the nut as a torque";
equation
  w = omega;
  i = k_p*(w_ref - omega) + x;
  der(x) = k_i*(w_ref - omega);
  der(phi) = omega;
  tau_m = K_t*(1 + torqueEffect.g_t)*i;
  friction.v = omega;
  friction.F_C = T_c;
  friction.b_v = b;
  tau_n = m*9.80665*k;
  (J + m*k^2)*der(omega) = tau_m - m*9.80665*k - friction.F_f - motorEffect.F - screwEffect.F;
  torqueEffect.i_q = i;
  motorEffect.v = omega;
  motorEffect.s = friction.s;
  motorEffect.z = phi;
  motorEffect.N = tau_m;
  screwEffect.v = omega;
  screwEffect.s = friction.s;
  screwEffect.z = phi;
  screwEffect.N = tau_n;
end LeadScrewDrive;
