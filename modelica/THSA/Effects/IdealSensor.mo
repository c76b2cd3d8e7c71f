within THSA.Effects;
block IdealSensor "Sensor without error"
  extends THSA.Interfaces.SensorEffect;
equation
  d = 0;
  annotation(Documentation(info="<html><p>Default of the sensor slots.</p></html>"));
end IdealSensor;
