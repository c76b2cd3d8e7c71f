within THSA.Effects;
block SensorGain "Sensor with a gain error"
  extends THSA.Interfaces.SensorEffect;
  parameter Real g(unit="1", min=-0.99, max=10) = 0 "Relative error";
equation
  d = g*u;
  annotation(Documentation(info="<html><p>Reading (1 + g) u.</p></html>"));
end SensorGain;
