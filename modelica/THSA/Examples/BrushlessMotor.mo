within THSA.Examples;
model BrushlessMotor "Brushless motor on a held voltage or under a speed loop, beside its measured angle"
  THSA.Interfaces.RealInput u_q(unit="V", start=0) "Voltage of the q axis";
  THSA.Interfaces.RealInput w_ref(unit="rad/s", start=0) "Reference of the speed loop";
  THSA.Interfaces.RealInput phi(unit="rad", start=0) "Measured angle of the rotor";
  THSA.Interfaces.RealOutput i_q(unit="A", nominal=0.1) "Current of the q axis, as measured";
  THSA.Interfaces.RealOutput w(unit="rad/s", nominal=10) "Speed of the rotor";
  parameter Real K_s(unit="A.s/rad", min=0, max=1e4) = 0 "Gain of the speed loop; 0: the voltage drives the motor";
  parameter Real R(unit="Ohm", min=1e-4, max=1e4) = 0.5 "Resistance of the q axis";
  parameter THSA.Units.Inductance L(min=1e-8, max=1) = 1e-4 "Inductance of the q axis";
  parameter THSA.Units.TorqueConstant K_t(min=1e-6, max=1e3) = 0.019 "Torque constant and back-EMF constant";
  parameter THSA.Units.Inertia J(min=1e-10, max=1e3) = 1e-4 "Inertia";
  parameter THSA.Units.Torque T_c(min=0, max=1e3) = 1e-3 "Coulomb friction torque";
  parameter Real b(unit="N.m.s/rad", min=0, max=1e3) = 0 "Viscous friction coefficient";
  parameter THSA.Units.AngularVelocity w_start(min=-1e5, max=1e5) = 0 "Speed at the start";
  THSA.Friction friction(v(unit="rad/s"), F_C(unit="N.m"), b_v(unit="N.m.s/rad"), F_f(unit="N.m"),
    b_q(unit="N.m.s2/rad2", min=-1e3, max=1e3), v_S(unit="rad/s", max=1e3) = 1, v_r(unit="rad/s", max=10) = 1e-2)
    "Friction";
  replaceable THSA.Effects.IdealInverter inverterEffect constrainedby THSA.Interfaces.VoltageEffect
    "Slot: voltage of the inverter";
  replaceable THSA.Effects.ConstantTorqueConstant torqueEffect constrainedby THSA.Interfaces.TorqueConstantEffect
    "Slot: torque constant";
  replaceable THSA.Effects.NoFriction motorEffect(v(unit="rad/s"), z(unit="rad"), N(unit="N.m"), F(unit="N.m"))
    constrainedby THSA.Interfaces.FrictionEffect
    "Slot: friction and torques at the motor";
  Real d_i(unit="A") = 0 "Error of the current's reading";
  Real d_u(unit="V") = 0 "Error of the inverter's voltage";
  THSA.Units.AngularVelocity omega(nominal=10) "Speed";
  THSA.Units.Current i_m(nominal=0.1) "Current of the winding on a held voltage";
  THSA.Units.Current i_t(nominal=0.1) "Current that makes the torque";
  THSA.Units.Torque tau_e(nominal=1e-3) "Electromagnetic torque";
initial equation
  omega = w_start;
  i_m = if K_s > 0 then 0 else (u_q - K_t*w_start)/R;
equation
  w = omega;
  i_q = if K_s > 0 then K_s*(w_ref - omega) else i_m + d_i;
  i_t = if K_s > 0 then i_q - d_i else i_m;
  L*der(i_m) = (if K_s > 0 then 0 else u_q + inverterEffect.du + d_u - K_t*(1 + torqueEffect.g_e)*omega) - R*i_m;
  tau_e = K_t*(1 + torqueEffect.g_t)*i_t;
  friction.v = omega;
  friction.F_C = T_c;
  friction.b_v = b;
  J*der(omega) = tau_e - friction.F_f - motorEffect.F;
  inverterEffect.i_q = i_t;
  torqueEffect.i_q = i_t;
  motorEffect.v = omega;
  motorEffect.s = friction.s;
  motorEffect.z = phi;
  motorEffect.N = tau_e;
  annotation(
    experiment(StartTime=0, StopTime=3, Tolerance=1e-6, Interval=1e-3),
    Documentation(info="<html>
<p>J d&omega;/dt = K_t i_q &minus; friction &minus; torques over the angle. With K_s = 0 a voltage drives the winding: L di_q/dt = u_q
&minus; R i_q &minus; K_t &omega;. With K_s &gt; 0 a fast current loop follows a proportional speed loop, i_q = K_s (w_ref &minus;
&omega;). i_q is the reading, which the loop controls; an error of it that turns with the rotor makes a torque then.</p>
<p>The angle is an input: torques that depend on it are taken at the measured angle, since a simulated one would be a tooth
off after a few turns, however small the error of the mean speed. Torques that the recordings cannot give in N.m (K_t is
not known) are right in proportion to K_t.</p></html>"),
    Icon(graphics={Rectangle(extent={{-80,60},{60,-60}}, lineColor={0,0,0}, fillColor={128,128,255}, fillPattern=FillPattern.HorizontalCylinder),
      Rectangle(extent={{60,10},{100,-10}}, lineColor={0,0,0}, fillColor={160,160,164}, fillPattern=FillPattern.HorizontalCylinder),
      Text(extent={{-100,100},{100,65}}, textString="%name", textColor={0,0,255})}));
end BrushlessMotor;
