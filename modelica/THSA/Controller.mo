within THSA;
model Controller "Velocity loop of the THSA: from velocity command and motor speed to the current reference"
  THSA.Interfaces.RealInput v_cmd(unit="m/s") "Velocity command";
  THSA.Interfaces.RealInput w_m(unit="rad/s") "Motor speed";
  THSA.Interfaces.RealOutput i_ref(unit="A") "Reference of the q-axis current";
  parameter THSA.Units.Ratio i(min=0.001, max=10000) = 30 "Gear ratio, motor to screw";
  parameter THSA.Units.Length P_h(min=1e-5, max=1) = 10e-3 "Lead of the screw";
  THSA.Controllers.VelocityController velocityController "Velocity loop, the law to tune";
equation
  velocityController.reference = v_cmd*i*2*3.141592653589793/P_h;
  connect(w_m, velocityController.measurement);
  connect(velocityController.y, i_ref);
  annotation(
    experiment(StartTime=0, StopTime=1.2, Tolerance=1e-6, Interval=1e-3),
    Documentation(info="<html><p>What <code>Plant</code> lacks to be the whole <code>Actuator</code>.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,-100},{100,100}}, lineColor={0,0,127}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-90,40},{90,-40}}, textString="PI", textColor={0,0,127}),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end Controller;
