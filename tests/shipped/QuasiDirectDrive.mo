within ;
model QuasiDirectDrive "Quasi-direct drive on a bench, position loop, seen at the output"
  THSA.Interfaces.RealInput q_ref(unit="rad") "Reference of the output's angle";
  THSA.Interfaces.RealOutput q(unit="rad") "Angle of the output";
  THSA.Interfaces.RealOutput w(unit="rad/s") "Speed of the output, as the drive filters it";
  THSA.Interfaces.RealOutput i(unit="A") "Current of the q axis";
  parameter Real K_t(unit="N.m/A") = 0.585 "Torque constant at the output";
  parameter Real J(unit="kg.m2", min=1e-6, max=1) = 4e-3 "Inertia at the output";
  parameter Real T_c(unit="N.m", min=0, max=10) = 0.15 "Coulomb friction";
  parameter Real b(unit="N.m.s/rad", min=0, max=10) = 0.01 "Viscous friction";
  parameter Real mu(unit="1", min=0, max=1) = 0.02 "Friction per torque of the gear";
  parameter Real c(unit="N.m/rad", min=-10, max=10) = 0 "Stiffness of a spring to the frame";
  parameter Real T_d(unit="s", min=1e-5, max=1) = 2e-3 "Lag of the loop";
  parameter Real T_f(unit="s", min=1e-5, max=1) = 1e-3 "Lag of the speed's filter";
  THSA.Friction friction(v(unit="rad/s"), F_C(unit="N.m"), b_v(unit="N.m.s/rad"), F_f(unit="N.m"), b_q(unit="N.m.s2/rad2"),
    v_r=1e-3) "Friction";
  Real phi(unit="rad", start=0, fixed=true) "Angle of the output";
  Real omega(unit="rad/s", start=0, fixed=true) "Speed of the output";
  Real i_m(unit="A", start=0, fixed=true) "Current";
  Real w_f(unit="rad/s", start=0, fixed=true) "Filtered speed";
equation
  T_f*der(w_f) = omega - w_f;
  T_d*der(i_m) = (60*(q_ref - phi) - 0.8*w_f)/0.6 - i_m;
  der(phi) = omega;
  friction.v = omega;
  friction.F_C = T_c + mu*noEvent(abs(K_t*i_m));
  friction.b_v = b;
  J*der(omega) = K_t*i_m - friction.F_f - c*phi;
  q = phi;
  w = w_f;
  i = i_m;
end QuasiDirectDrive;
