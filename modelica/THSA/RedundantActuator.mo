within THSA;
model RedundantActuator "THSA with two motor lanes, active and standby, and two load paths"
  THSA.Interfaces.RealInput v_cmd(unit="m/s") "Velocity command";
  THSA.Interfaces.RealInput F_load(unit="N") "Aerodynamic force, positive opposes positive velocity";
  THSA.Interfaces.RealInput T_amb(unit="degC", start=25, min=-90, max=150) "Temperature of the surroundings, and of every part without its own";
  THSA.Interfaces.RealInput T_motor(unit="degC", start=-300, min=-300, max=200) "Temperature of the motors; below absolute zero: not connected, T_amb";
  THSA.Interfaces.RealInput T_gearbox(unit="degC", start=-300, min=-300, max=200) "Temperature of the gearbox; below absolute zero: not connected, T_amb";
  THSA.Interfaces.RealInput T_screw(unit="degC", start=-300, min=-300, max=200) "Temperature of screw and nut; below absolute zero: not connected, T_amb";
  THSA.Interfaces.RealOutput v(unit="m/s", nominal=1e-3) "Measured output velocity";
  THSA.Interfaces.RealOutput x(unit="m", nominal=1e-2) "Output position";
  THSA.Interfaces.RealOutput w_A(unit="rad/s", nominal=10) "Speed of motor A, as measured";
  THSA.Interfaces.RealOutput w_B(unit="rad/s", nominal=10) "Speed of motor B, as measured";
  THSA.Interfaces.RealOutput i_A(unit="A") "Current of motor A";
  THSA.Interfaces.RealOutput i_B(unit="A") "Current of motor B";
  THSA.Interfaces.RealOutput u_A(unit="V", nominal=10) "Voltage of motor A";
  THSA.Interfaces.RealOutput u_B(unit="V", nominal=10) "Voltage of motor B";
  THSA.Interfaces.RealOutput F_1(unit="N", nominal=1e3) "Force on the primary load path";
  THSA.Interfaces.RealOutput F_2(unit="N", nominal=1e3) "Force on the secondary load path";
  THSA.Interfaces.RealOutput active(unit="1") "Lane that drives: 1 lane A, 2 lane B, 0 none";
  THSA.Interfaces.RealOutput P_el(unit="W", nominal=100) "Power at the terminals of both motors";
  THSA.Interfaces.RealOutput E_res(unit="J") "Residual of the energy balance, from the start";
  parameter THSA.Units.Time t_jam(min=-1, max=1e9) = 1e9 "Failure: time from which the screw is jammed";
  parameter THSA.Units.Time t_sensor(min=-1, max=1e9) = 1e9 "Failure: time from which the output's velocity sensor reads 0";
  parameter THSA.Units.Torque T_jam(min=0, max=1e6) = 3000 "Torque of a jam or of the lock at the screw";
  THSA.Redundancy.Monitor monitor "Active and standby";
  THSA.Redundancy.Lane laneA(tau_f=motorAEffect.F, du=inverterAEffect.du, g_R=windingAEffect.g_R, g_psi=windingAEffect.g_psi,
    g_t=torqueAEffect.g_t, g_e=torqueAEffect.g_e, d_i=currentSensorAEffect.d) "Lane A, active";
  THSA.Redundancy.Lane laneB(tau_f=motorBEffect.F, du=inverterBEffect.du, g_R=windingBEffect.g_R, g_psi=windingBEffect.g_psi,
    g_t=torqueBEffect.g_t, g_e=torqueBEffect.g_e, d_i=currentSensorBEffect.d) "Lane B, standby";
  THSA.Redundancy.Differential differential "Differential";
  THSA.Gearbox gearbox(tau_f=gearboxEffect.F + (if time >= t_jam or monitor.locked then T_jam*gearbox.friction.s else 0)) "Gearbox";
  THSA.NoBack noBack "No-back device";
  THSA.Redundancy.LoadPath primary(e=contactPrimaryEffect.e, v_e=contactPrimaryEffect.v_e, k_e=contactPrimaryEffect.k_e)
    "Primary load path: roller screw and nut";
  THSA.Redundancy.LoadPath secondary(k_s=1.5e8, d_s=2.5e5, gap=1e-3, e=contactSecondaryEffect.e, v_e=contactSecondaryEffect.v_e,
    k_e=contactSecondaryEffect.k_e) "Secondary load path: tie rod and its nut";
  THSA.Nut nut(F_f=(if primary.broken then -nut.friction.F_f else screwPrimaryEffect.F)
    + screwSecondaryEffect.F) "Nuts; a broken path takes its friction along";
  THSA.Stabilizer stabilizer "Stabilizer";
  THSA.VelocitySensor sensor "Velocity sensor";
  replaceable THSA.Thermal.GivenTemperatures temperatures constrainedby THSA.Interfaces.PartTemperatures
    "Slot: temperatures of the parts";
  replaceable THSA.Effects.IdealInverter inverterAEffect constrainedby THSA.Interfaces.VoltageEffect(phi=laneA.motor.phi)
    "Slot: voltage of the inverter of lane A";
  replaceable THSA.Effects.NoHeating windingAEffect constrainedby THSA.Interfaces.HeatingEffect
    "Slot: heating of winding and magnets of motor A";
  replaceable THSA.Effects.ConstantTorqueConstant torqueAEffect constrainedby THSA.Interfaces.TorqueConstantEffect
    "Slot: torque constant of motor A";
  replaceable THSA.Effects.NoFriction motorAEffect(v(unit="rad/s"), z(unit="rad"), N(unit="N.m"), F(unit="N.m")) constrainedby THSA.Interfaces.FrictionEffect
    "Slot: friction and torques at motor A and its brake";
  replaceable THSA.Effects.IdealSensor currentSensorAEffect(u(unit="A"), d(unit="A")) constrainedby THSA.Interfaces.SensorEffect
    "Slot: sensor of the current of lane A [A], which its loop uses";
  replaceable THSA.Effects.IdealInverter inverterBEffect constrainedby THSA.Interfaces.VoltageEffect(phi=laneB.motor.phi)
    "Slot: voltage of the inverter of lane B";
  replaceable THSA.Effects.NoHeating windingBEffect constrainedby THSA.Interfaces.HeatingEffect
    "Slot: heating of winding and magnets of motor B";
  replaceable THSA.Effects.ConstantTorqueConstant torqueBEffect constrainedby THSA.Interfaces.TorqueConstantEffect
    "Slot: torque constant of motor B";
  replaceable THSA.Effects.NoFriction motorBEffect(v(unit="rad/s"), z(unit="rad"), N(unit="N.m"), F(unit="N.m")) constrainedby THSA.Interfaces.FrictionEffect
    "Slot: friction and torques at motor B and its brake";
  replaceable THSA.Effects.IdealSensor currentSensorBEffect(u(unit="A"), d(unit="A")) constrainedby THSA.Interfaces.SensorEffect
    "Slot: sensor of the current of lane B [A], which its loop uses";
  replaceable THSA.Effects.NoFriction gearboxEffect(v(unit="rad/s"), z(unit="rad"), N(unit="N.m"), F(unit="N.m")) constrainedby THSA.Interfaces.FrictionEffect
    "Slot: friction and torques at the gearbox's output shaft";
  replaceable THSA.Effects.NoContact contactPrimaryEffect constrainedby THSA.Interfaces.ContactEffect(t_d=primary.d_s/primary.k_s)
    "Slot: contact of screw and nut of the primary load path";
  replaceable THSA.Effects.NoFriction screwPrimaryEffect(v(unit="m/s"), z(unit="m"), N(unit="N"), F(unit="N")) constrainedby THSA.Interfaces.FrictionEffect
    "Slot: friction of the primary load path's nut";
  replaceable THSA.Effects.NoContact contactSecondaryEffect constrainedby THSA.Interfaces.ContactEffect(t_d=secondary.d_s/secondary.k_s)
    "Slot: contact of screw and nut of the secondary load path";
  replaceable THSA.Effects.NoFriction screwSecondaryEffect(v(unit="m/s"), z(unit="m"), N(unit="N"), F(unit="N")) constrainedby THSA.Interfaces.FrictionEffect
    "Slot: friction of the secondary load path's nut";
  replaceable THSA.Effects.IdealSensor velocitySensorEffect(u(unit="m/s"), d(unit="m/s")) constrainedby THSA.Interfaces.SensorEffect
    "Slot: sensor of the output velocity [m/s]";
  THSA.Units.Power P_loss "All that becomes heat";
  THSA.Units.Energy E_stored "Energy of masses, windings and contacts";
  THSA.Units.Energy E_net(nominal=10) "Energy that has come in and has neither gone out nor become heat";
initial equation
  stabilizer.x = -F_load/primary.k_s;
  E_net = E_stored;
equation
  monitor.w_ref = v_cmd*gearbox.i/primary.k;
  monitor.w_A = laneA.w_s;
  monitor.w_B = laneB.w_s;
  monitor.w_v = v*gearbox.i/primary.k;
  monitor.F_2 = secondary.F_s;
  connect(monitor.enable_A, laneA.enable);
  connect(monitor.enable_B, laneB.enable);
  connect(monitor.release_A, laneA.release);
  connect(monitor.release_B, laneB.release);
  connect(monitor.ref_A, laneA.reference);
  connect(monitor.ref_B, laneB.reference);
  connect(laneA.flange, differential.flange_a1);
  connect(laneB.flange, differential.flange_a2);
  connect(differential.flange_b, gearbox.flange_a);
  connect(gearbox.flange_b, noBack.flange_a);
  connect(noBack.flange_b, primary.flange_a);
  connect(noBack.flange_b, secondary.flange_a);
  connect(primary.flange_b, nut.flange_a);
  connect(secondary.flange_b, nut.flange_a);
  connect(nut.flange_b, stabilizer.flange);
  connect(stabilizer.flange, sensor.flange);
  connect(F_load, stabilizer.F_load);
  connect(T_amb, temperatures.T_amb);
  connect(T_motor, temperatures.T_motor);
  connect(T_gearbox, temperatures.T_gearbox);
  connect(T_screw, temperatures.T_screw);
  temperatures.P_winding = laneA.motor.P_co + laneB.motor.P_co;
  temperatures.P_motor = laneA.motor.P_f + laneB.motor.P_f;
  temperatures.P_gearbox = gearbox.P_f + noBack.P_f;
  temperatures.P_screw = nut.P_f;
  connect(temperatures.motor, laneA.T);
  connect(temperatures.motor, laneB.T);
  connect(temperatures.winding, laneA.T_w);
  connect(temperatures.winding, laneB.T_w);
  connect(temperatures.gearbox, gearbox.T);
  connect(temperatures.screw, nut.T);
  inverterAEffect.i_q = laneA.motor.i_q;
  windingAEffect.P = laneA.motor.P_co;
  torqueAEffect.i_q = laneA.motor.i_q;
  motorAEffect.v = laneA.motor.w_m;
  motorAEffect.s = laneA.motor.friction.s;
  motorAEffect.z = laneA.motor.phi;
  motorAEffect.N = laneA.motor.tau_e;
  currentSensorAEffect.u = laneA.motor.i_q;
  inverterBEffect.i_q = laneB.motor.i_q;
  windingBEffect.P = laneB.motor.P_co;
  torqueBEffect.i_q = laneB.motor.i_q;
  motorBEffect.v = laneB.motor.w_m;
  motorBEffect.s = laneB.motor.friction.s;
  motorBEffect.z = laneB.motor.phi;
  motorBEffect.N = laneB.motor.tau_e;
  currentSensorBEffect.u = laneB.motor.i_q;
  gearboxEffect.v = gearbox.w_g;
  gearboxEffect.s = gearbox.friction.s;
  gearboxEffect.z = gearbox.flange_b.phi;
  gearboxEffect.N = noBack.tau_s;
  contactPrimaryEffect.phi = primary.flange_a.phi;
  contactPrimaryEffect.w = noBack.w;
  contactPrimaryEffect.delta = primary.delta;
  contactPrimaryEffect.v_s = primary.v_s;
  screwPrimaryEffect.v = nut.v;
  screwPrimaryEffect.s = nut.friction.s;
  screwPrimaryEffect.z = stabilizer.x;
  screwPrimaryEffect.N = primary.F_s;
  contactSecondaryEffect.phi = secondary.flange_a.phi;
  contactSecondaryEffect.w = noBack.w;
  contactSecondaryEffect.delta = secondary.delta;
  contactSecondaryEffect.v_s = secondary.v_s;
  screwSecondaryEffect.v = nut.v;
  screwSecondaryEffect.s = nut.friction.s;
  screwSecondaryEffect.z = stabilizer.x;
  screwSecondaryEffect.N = secondary.F_s;
  velocitySensorEffect.u = sensor.y;
  v = if time >= t_sensor then 0 else sensor.y + velocitySensorEffect.d;
  x = stabilizer.x;
  w_A = laneA.w_s;
  w_B = laneB.w_s;
  i_A = laneA.currentController.measurement;
  i_B = laneB.currentController.measurement;
  u_A = laneA.motor.u_q;
  u_B = laneB.motor.u_q;
  F_1 = primary.F_s;
  F_2 = secondary.F_s;
  active = if monitor.active_A then 1 elseif monitor.active_B then 2 else 0;
  P_el = laneA.P_el + laneB.P_el;
  P_loss = laneA.P_loss + laneB.P_loss + gearbox.P_f + noBack.P_f + primary.P_d + secondary.P_d + nut.P_f;
  E_stored = laneA.E + laneB.E + primary.E + secondary.E + 0.5*stabilizer.M*stabilizer.v^2;
  der(E_net) = P_el - P_loss - F_load*stabilizer.v;
  E_res = E_net - E_stored;
  annotation(
    experiment(StartTime=0, StopTime=3, Tolerance=1e-6, Interval=1e-3),
    Documentation(info="<html><p>Two motors with power-off brakes drive the gearbox of <code>Actuator</code> through a
speed-summing differential. Lane A drives while lane B is held by its brake; then the model is <code>Actuator</code>, but for
the creep of the closed brake. The monitor changes to lane B when lane A has failed, and shuts both off when the secondary
load path is loaded, whose nut then locks the screw.</p>
<p>Failures are parameters, the times from which they are there: <code>laneA.t_loss</code>, <code>laneA.t_sensor</code>,
<code>laneA.t_jam</code>, <code>laneA.brake.t_stuck</code>, <code>laneA.brake.t_slip</code>, the same of lane B,
<code>t_jam</code> of the screw, <code>t_sensor</code> of the output's sensor, <code>primary.t_rupture</code>.</p>
<p>Effects have a slot in every lane (<code>motorAEffect</code>, <code>motorBEffect</code>) and in either load path
(<code>contactPrimaryEffect</code>, <code>screwSecondaryEffect</code>).</p>
<p><code>E_res</code> is what the energy balance lacks: electrical energy in, less work on the surroundings, less heat, less
the change of the stored energy. Ideally it is 0.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={0,60,100}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-80,40},{80,-40}}, textString="2 x THSA", textColor={0,60,100}),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end RedundantActuator;
