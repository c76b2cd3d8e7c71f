within THSA.Effects;
block SensorOffset "Sensor with an offset"
  extends THSA.Interfaces.SensorEffect;
  parameter Real o = 0 "Offset";
equation
  d = o;
  annotation(Documentation(info="<html><p>Reading u + o.</p></html>"));
end SensorOffset;
