within THSA;
model Actuator "THSA in closed velocity loop, every loss a law over temperature"
  THSA.Interfaces.RealInput v_cmd(unit="m/s") "Velocity command";
  THSA.Interfaces.RealInput F_load(unit="N") "Aerodynamic force, positive opposes positive velocity";
  THSA.Interfaces.RealInput T_amb(unit="degC", start=25, min=-90, max=150) "Temperature of the surroundings, and of every part without its own";
  THSA.Interfaces.RealInput T_motor(unit="degC", start=-300, min=-300, max=200) "Temperature of the motor; below absolute zero: not connected, T_amb";
  THSA.Interfaces.RealInput T_gearbox(unit="degC", start=-300, min=-300, max=200) "Temperature of the gearbox; below absolute zero: not connected, T_amb";
  THSA.Interfaces.RealInput T_screw(unit="degC", start=-300, min=-300, max=200) "Temperature of screw and nut; below absolute zero: not connected, T_amb";
  THSA.Interfaces.RealOutput v(unit="m/s", nominal=1e-3) "Measured output velocity";
  THSA.Interfaces.RealOutput x(unit="m", nominal=1e-2) "Output position";
  THSA.Interfaces.RealOutput w_m(unit="rad/s", nominal=10) "Motor speed";
  THSA.Interfaces.RealOutput i_q(unit="A") "Current of the q axis";
  THSA.Interfaces.RealOutput u_q(unit="V", nominal=10) "Voltage of the q axis";
  THSA.Controllers.VelocityController velocityController "Velocity loop, the law to tune";
  THSA.Controllers.CurrentController currentController "Current loop";
  replaceable THSA.Thermal.GivenTemperatures temperatures constrainedby THSA.Interfaces.PartTemperatures
    "Slot: temperatures of the parts";
  THSA.Motor motor(T_w=temperatures.winding, du=inverterEffect.du, g_R=windingEffect.g_R, g_psi=windingEffect.g_psi, g_t=torqueEffect.g_t, g_e=torqueEffect.g_e,
    tau_f=motorEffect.F) "Motor";
  THSA.Gearbox gearbox(tau_f=gearboxEffect.F) "Gearbox";
  THSA.NoBack noBack "No-back device";
  THSA.Screw screw(e=contactEffect.e, v_e=contactEffect.v_e, k_e=contactEffect.k_e, tau_f=shaftEffect.tau) "Roller screw";
  THSA.Nut nut(F_f=screwEffect.F) "Nut";
  THSA.Stabilizer stabilizer "Stabilizer";
  THSA.VelocitySensor sensor "Velocity sensor";
  replaceable THSA.Effects.IdealInverter inverterEffect constrainedby THSA.Interfaces.VoltageEffect(phi=motor.phi)
    "Slot: voltage of the inverter";
  replaceable THSA.Effects.NoHeating windingEffect constrainedby THSA.Interfaces.HeatingEffect
    "Slot: heating of winding and magnets";
  replaceable THSA.Effects.ConstantTorqueConstant torqueEffect constrainedby THSA.Interfaces.TorqueConstantEffect
    "Slot: torque constant";
  replaceable THSA.Effects.NoFriction motorEffect(v(unit="rad/s"), z(unit="rad"), N(unit="N.m"), F(unit="N.m"))
    constrainedby THSA.Interfaces.FrictionEffect
    "Slot: friction and torques at the motor";
  replaceable THSA.Effects.NoFriction gearboxEffect(v(unit="rad/s"), z(unit="rad"), N(unit="N.m"), F(unit="N.m"))
    constrainedby THSA.Interfaces.FrictionEffect
    "Slot: friction and torques at the gearbox's output shaft";
  replaceable THSA.Effects.NoTorque shaftEffect constrainedby THSA.Interfaces.ShaftEffect
    "Slot: torques at the screw's shaft";
  replaceable THSA.Effects.NoContact contactEffect constrainedby THSA.Interfaces.ContactEffect(t_d=screw.d_s/screw.k_s)
    "Slot: contact of screw and nut";
  replaceable THSA.Effects.NoFriction screwEffect(v(unit="m/s"), z(unit="m"), N(unit="N"), F(unit="N"))
    constrainedby THSA.Interfaces.FrictionEffect
    "Slot: friction between screw and nut";
  replaceable THSA.Effects.IdealSensor currentSensorEffect(u(unit="A"), d(unit="A"))
    constrainedby THSA.Interfaces.SensorEffect
    "Slot: sensor of the current [A], which the current loop uses";
  replaceable THSA.Effects.IdealSensor velocitySensorEffect(u(unit="m/s"), d(unit="m/s"))
    constrainedby THSA.Interfaces.SensorEffect
    "Slot: sensor of the output velocity [m/s]";
initial equation
  stabilizer.x = -F_load/screw.k_s;
equation
  velocityController.reference = v_cmd*gearbox.i/screw.k;
  connect(motor.w_m, velocityController.measurement);
  connect(velocityController.y, currentController.reference);
  currentSensorEffect.u = motor.i_q;
  currentController.measurement = motor.i_q + currentSensorEffect.d;
  connect(currentController.y, motor.u_q);
  connect(motor.flange, gearbox.flange_a);
  connect(gearbox.flange_b, noBack.flange_a);
  connect(noBack.flange_b, screw.flange_a);
  connect(screw.flange_b, nut.flange_a);
  connect(nut.flange_b, stabilizer.flange);
  connect(stabilizer.flange, sensor.flange);
  connect(F_load, stabilizer.F_load);
  connect(T_amb, temperatures.T_amb);
  connect(T_motor, temperatures.T_motor);
  connect(T_gearbox, temperatures.T_gearbox);
  connect(T_screw, temperatures.T_screw);
  temperatures.P_winding = motor.P_co;
  temperatures.P_motor = motor.P_f;
  temperatures.P_gearbox = gearbox.P_f + noBack.P_f;
  temperatures.P_screw = nut.P_f;
  connect(temperatures.motor, motor.T);
  connect(temperatures.gearbox, gearbox.T);
  connect(temperatures.screw, nut.T);
  velocitySensorEffect.u = sensor.y;
  v = sensor.y + velocitySensorEffect.d;
  x = stabilizer.x;
  connect(motor.w_m, w_m);
  i_q = currentController.measurement;
  connect(currentController.y, u_q);
  inverterEffect.i_q = motor.i_q;
  windingEffect.P = motor.P_co;
  torqueEffect.i_q = motor.i_q;
  motorEffect.v = motor.w_m;
  motorEffect.s = motor.friction.s;
  motorEffect.z = motor.phi;
  motorEffect.N = motor.tau_e;
  gearboxEffect.v = gearbox.w_g;
  gearboxEffect.s = gearbox.friction.s;
  gearboxEffect.z = gearbox.flange_b.phi;
  gearboxEffect.N = noBack.tau_s;
  shaftEffect.phi = screw.flange_a.phi;
  shaftEffect.w = noBack.w;
  shaftEffect.T = screw.T_c;
  contactEffect.phi = screw.flange_a.phi;
  contactEffect.w = noBack.w;
  contactEffect.delta = screw.delta;
  contactEffect.v_s = screw.v_s;
  screwEffect.v = nut.v;
  screwEffect.s = nut.friction.s;
  screwEffect.z = stabilizer.x;
  screwEffect.N = screw.F_s;
  annotation(
    experiment(StartTime=0, StopTime=1.2, Tolerance=1e-6, Interval=1e-3),
    Documentation(info="<html><p>The whole actuator. It starts at rest, in equilibrium under the load at the start, the
screw's angle at zero: x = &minus;F_load/k_s.</p>
<p>Every part is at <code>T_amb</code> until its own temperature is connected; in <code>ThermalActuator</code> a thermal
network computes what is not connected.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,-100},{100,100}}, lineColor={0,60,100}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-90,40},{90,-40}}, textString="THSA", textColor={0,60,100}),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end Actuator;
