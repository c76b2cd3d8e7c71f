within THSA;
model Plant "THSA without its velocity loop: from the current reference to the stabilizer"
  THSA.Interfaces.RealInput i_ref(unit="A") "Reference of the q-axis current";
  THSA.Interfaces.RealInput F_load(unit="N") "Aerodynamic force, positive opposes positive velocity";
  THSA.Interfaces.RealInput T_amb(unit="degC", start=25, min=-90, max=150) "Temperature of motor, gearbox and screw";
  THSA.Interfaces.RealOutput v(unit="m/s", nominal=1e-3) "Measured output velocity";
  THSA.Interfaces.RealOutput x(unit="m", nominal=1e-2) "Output position";
  THSA.Interfaces.RealOutput w_m(unit="rad/s", nominal=10) "Motor speed";
  THSA.Interfaces.RealOutput i_q(unit="A") "Current of the q axis";
  THSA.Interfaces.RealOutput u_q(unit="V", nominal=10) "Voltage of the q axis";
  THSA.Controllers.CurrentController currentController "Current loop";
  THSA.Motor motor "Motor";
  THSA.Gearbox gearbox "Gearbox";
  THSA.NoBack noBack "No-back device";
  THSA.Screw screw "Roller screw";
  THSA.Nut nut "Nut";
  THSA.Stabilizer stabilizer "Stabilizer";
  THSA.VelocitySensor sensor "Velocity sensor";
initial equation
  stabilizer.x = -F_load/screw.k_s;
equation
  connect(i_ref, currentController.reference);
  connect(motor.i_q, currentController.measurement);
  connect(currentController.y, motor.u_q);
  connect(motor.flange, gearbox.flange_a);
  connect(gearbox.flange_b, noBack.flange_a);
  connect(noBack.flange_b, screw.flange_a);
  connect(screw.flange_b, nut.flange_a);
  connect(nut.flange_b, stabilizer.flange);
  connect(stabilizer.flange, sensor.flange);
  connect(F_load, stabilizer.F_load);
  connect(T_amb, motor.T);
  connect(T_amb, gearbox.T);
  connect(T_amb, nut.T);
  connect(sensor.y, v);
  x = stabilizer.x;
  connect(motor.w_m, w_m);
  connect(motor.i_q, i_q);
  connect(currentController.y, u_q);
  annotation(
    experiment(StartTime=0, StopTime=1.2, Tolerance=1e-6, Interval=1e-3),
    Documentation(info="<html><p><code>Actuator</code> cut at its current command: with <code>Controller</code> it is the
whole again, as a system of two FMUs. It starts at rest, in equilibrium under the load at the start.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,-100},{100,100}}, lineColor={0,60,100}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-90,40},{90,-40}}, textString="plant", textColor={0,60,100}),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end Plant;
