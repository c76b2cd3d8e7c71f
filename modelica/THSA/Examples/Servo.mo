within THSA.Examples;
model Servo "Geared servo that swings a pendulum: position law, direct-current motor, gear with losses"
  THSA.Interfaces.RealInput q_ref(unit="rad") "Reference of the position";
  THSA.Interfaces.RealInput U_in(unit="V", start=7.4) "Supply voltage as the servo measures it";
  THSA.Interfaces.RealInput on(unit="1", start=1) "1: torque enabled; 0: the motor's terminals are open";
  THSA.Interfaces.RealOutput q(unit="rad", nominal=1) "Position of the output shaft, 0 where the pendulum should hang";
  THSA.Interfaces.RealOutput w(unit="rad/s", nominal=1) "Speed of the output shaft";
  THSA.Interfaces.RealOutput duty(unit="1", nominal=100) "Duty cycle in counts";
  THSA.Interfaces.RealOutput i(unit="A", nominal=1) "Current of the motor";
  parameter THSA.Units.TorqueConstant K_t(min=1e-6, max=1e3) = 0.354 "Torque constant at the output shaft";
  parameter Real R(unit="Ohm", min=1e-4, max=1e4) = 3.4 "Resistance of winding, bridge and leads";
  parameter THSA.Units.Inductance L(min=1e-7, max=1) = 1e-3 "Inductance";
  parameter THSA.Units.Inertia J(min=1e-9, max=1e3) = 1.7e-3 "Inertia of the rotor, seen at the output shaft";
  parameter THSA.Units.Torque T_c(min=0, max=1e3) = 0.01 "Coulomb friction torque";
  parameter Real b(unit="N.m.s/rad", min=0, max=1e3) = 0.005 "Viscous friction coefficient";
  parameter THSA.Units.Mass m(min=0, max=1e3) = 0.49 "Mass at the end of the pendulum";
  parameter THSA.Units.Length l(min=0, max=100) = 0.1 "Length of the pendulum";
  parameter THSA.Units.Angle phi_0(min=-7, max=7) = 0 "Angle of the pendulum where the position sensor reads 0";
  parameter Real i_g(unit="1", min=1e-3, max=1e5) = 288.35 "Gear ratio";
  parameter THSA.Units.Angle q_start(min=-100, max=100) = 0 "Position at the start";
  parameter Real g(unit="m/s2") = 9.80665 "Acceleration of gravity";
  THSA.Controllers.DutyController controller "Position law";
  THSA.Friction friction(v(unit="rad/s"), F_C(unit="N.m"), b_v(unit="N.m.s/rad"), F_f(unit="N.m"),
    b_q(unit="N.m.s2/rad2", min=-1e3, max=1e3), v_S(unit="rad/s", max=1e3) = 0.1, v_r(unit="rad/s", max=1) = 1e-4)
    "Friction that does not depend on the load";
  replaceable THSA.Effects.IdealInverter inverterEffect constrainedby THSA.Interfaces.VoltageEffect
    "Slot: voltage of the bridge";
  replaceable THSA.Effects.NoHeating windingEffect constrainedby THSA.Interfaces.HeatingEffect
    "Slot: heating of winding and magnets";
  replaceable THSA.Effects.ConstantTorqueConstant torqueEffect constrainedby THSA.Interfaces.TorqueConstantEffect
    "Slot: torque constant";
  replaceable THSA.Effects.NoFriction gearEffect(v(unit="rad/s"), z(unit="rad"), N(unit="N.m"), F(unit="N.m"))
    constrainedby THSA.Interfaces.FrictionEffect
    "Slot: losses of the gear";
  replaceable THSA.Effects.NoFriction motorEffect(v(unit="rad/s"), z(unit="rad"), N(unit="N.m"), F(unit="N.m"))
    constrainedby THSA.Interfaces.FrictionEffect
    "Slot: friction and torques at the motor, seen at the output shaft";
  replaceable THSA.Effects.NoFriction bearingEffect(v(unit="rad/s"), z(unit="rad"), N(unit="N.m"), F(unit="N.m"))
    constrainedby THSA.Interfaces.FrictionEffect
    "Slot: friction of the output shaft's bearing";
  THSA.Units.Angle phi(nominal=1) "Angle of the output shaft";
  THSA.Units.AngularVelocity omega(nominal=1) "Speed of the output shaft";
  THSA.Units.Current i_m(nominal=1) "Current";
  THSA.Units.Torque tau_m(nominal=0.1) "Torque of the motor at the output shaft";
  THSA.Units.Torque tau_g(nominal=0.1) "Torque of gravity";
  THSA.Units.Torque tau_t(nominal=0.1) "Torque that the motor's shaft passes to the gear";
initial equation
  phi = q_start;
  omega = 0;
  i_m = 0;
equation
  q = phi;
  w = omega;
  i = i_m;
  connect(q_ref, controller.reference);
  controller.q = phi;
  connect(U_in, controller.U_in);
  connect(controller.duty, duty);
  L*der(i_m) = (if on > 0.5 then controller.u + inverterEffect.du - K_t*(1 + torqueEffect.g_e)*(1 + windingEffect.g_psi)*omega else 0)
    - R*(1 + windingEffect.g_R)*i_m;
  tau_m = K_t*(1 + torqueEffect.g_t)*(1 + windingEffect.g_psi)*i_m;
  tau_g = m*g*l*sin(phi + phi_0);
  friction.v = omega;
  friction.F_C = T_c;
  friction.b_v = b;
  der(phi) = omega;
  (J + m*l^2)*der(omega) = tau_m - tau_g - friction.F_f - motorEffect.F - gearEffect.F - bearingEffect.F;
  tau_t = tau_m - J/(J + m*l^2)*(tau_m - tau_g - friction.F_f);
  inverterEffect.i_q = i_m;
  windingEffect.P = R*(1 + windingEffect.g_R)*i_m^2;
  torqueEffect.i_q = i_m;
  motorEffect.v = omega;
  motorEffect.s = friction.s;
  motorEffect.z = i_g*phi;
  motorEffect.N = tau_t;
  gearEffect.v = omega;
  gearEffect.s = friction.s;
  gearEffect.z = phi;
  gearEffect.N = tau_t;
  bearingEffect.v = omega;
  bearingEffect.s = friction.s;
  bearingEffect.z = phi;
  bearingEffect.N = tau_g;
  annotation(
    experiment(StartTime=0, StopTime=6, Tolerance=1e-6, Interval=5e-3),
    Documentation(info="<html>
<p>A servo with a direct-current motor and a gear holds a mass m at the end of an arm l: L di/dt = u &minus; R i &minus; K_t
&omega; while the torque is enabled; with it disabled the terminals are open, the current dies out, and the pendulum
falls against friction alone. All quantities of the motor are seen at the output shaft.</p>
<p>tau_t, the load of the gear and of the motor's bearings, is the motor's torque less what accelerates the rotor, as it
would be without losses of the gear; the load of the output shaft's bearing is the pendulum's weight as a torque. The
defaults are those of a small servo's data sheet (stall torque by stall current, supply by stall current).</p></html>"),
    Icon(graphics={Rectangle(extent={{-90,90},{-20,30}}, lineColor={0,0,0}, fillColor={128,128,255}, fillPattern=FillPattern.Solid),
      Line(points={{-55,60},{30,-50}}, color={0,0,0}, thickness=1),
      Ellipse(extent={{10,-30},{50,-70}}, lineColor={0,0,0}, fillColor={160,160,164}, fillPattern=FillPattern.Solid),
      Text(extent={{-100,-75},{100,-100}}, textString="%name", textColor={0,0,255})}));
end Servo;
