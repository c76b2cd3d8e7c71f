within THSA.Redundancy;
model Lane "Motor lane: power electronics, velocity and current loop, motor with brake"
  THSA.Interfaces.RealInput reference(unit="rad/s") "Reference of the motor's speed";
  THSA.Interfaces.BooleanInput enable "The electronics drive the motor";
  THSA.Interfaces.BooleanInput release "The brake is to be open";
  THSA.Interfaces.RealInput T(unit="degC") "Temperature of magnets and bearings";
  THSA.Interfaces.RealInput T_w(unit="degC") "Temperature of the winding";
  THSA.Interfaces.RealOutput w_s(unit="rad/s") "Speed as the resolver gives it";
  THSA.Interfaces.RotationalFlange flange "Shaft";
  input THSA.Units.Torque tau_f = 0 "Added friction torque at the motor";
  input THSA.Units.Voltage du = 0 "Voltage that the inverter adds";
  input THSA.Units.Ratio g_R = 0 "Relative change of the winding resistance";
  input THSA.Units.Ratio g_psi = 0 "Relative change of the magnets' flux";
  input THSA.Units.Ratio g_t = 0 "Relative change of the torque constant";
  input THSA.Units.Ratio g_e = 0 "Relative change of the back-EMF constant";
  input THSA.Units.Current d_i = 0 "Error of the current sensor, which the current loop uses";
  parameter THSA.Units.Time t_loss(min=-1, max=1e9) = 1e9 "Failure: time from which the electronics give no current";
  parameter THSA.Units.Time t_sensor(min=-1, max=1e9) = 1e9 "Failure: time from which the resolver reads 0";
  parameter THSA.Units.Time t_jam(min=-1, max=1e9) = 1e9 "Failure: time from which the rotor is jammed";
  parameter THSA.Units.Torque T_jam(min=0, max=1e5) = 200 "Torque of a jam";
  THSA.Controllers.VelocityController velocityController(K_p=0.363, K_i=2.98) "Velocity loop, the law to tune";
  THSA.Controllers.CurrentController currentController "Current loop";
  THSA.Redundancy.MotorBrake brake "Motor brake";
  THSA.Motor motor(T_w=T_w, du=du, g_R=g_R, g_psi=g_psi, g_t=g_t, g_e=g_e,
    tau_f=brake.tau + (if time >= t_jam then T_jam*motor.friction.s else 0) + tau_f) "Motor";
  Boolean powered "The bridge drives";
  THSA.Units.Power P_el "Power at the motor's terminals";
  THSA.Units.Power P_loss "All that the lane turns into heat";
  THSA.Units.Energy E "Energy of rotor and winding";
equation
  powered = enable and time < t_loss;
  w_s = if time >= t_sensor then 0 else motor.w_m;
  velocityController.reference = if powered then reference else w_s;
  velocityController.measurement = w_s;
  currentController.measurement = motor.i_q + d_i;
  currentController.reference = if powered then velocityController.y else currentController.measurement;
  motor.u_q = if powered then currentController.y else motor.K_t*motor.w_m;
  connect(T, motor.T);
  connect(motor.friction.s, brake.s);
  connect(release, brake.release);
  connect(motor.flange, flange);
  P_el = motor.u_q*motor.i_q;
  P_loss = motor.P_co + motor.P_f;
  E = 0.5*motor.J*motor.w_m^2 + 0.5*motor.L*motor.i_q^2;
  annotation(
    Documentation(info="<html><p>The motor with its loops as in <code>Actuator</code>, with the gains of table IV that were
optimised at &minus;30 degC. A lane without power has an open bridge: the winding sees its back-EMF, and the current dies
away with L/R_s. Its loops rest: without error, with their integrators as they were.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={0,60,100}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-80,40},{80,-40}}, textString="lane", textColor={0,60,100}),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end Lane;
