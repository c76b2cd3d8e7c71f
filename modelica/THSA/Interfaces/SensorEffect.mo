within THSA.Interfaces;
partial block SensorEffect "Effect that adds to the reading of a sensor"
  THSA.Interfaces.RealInput u "True value";
  THSA.Interfaces.RealOutput d "Added error";
  annotation(
    Documentation(info="<html><p>Place of sensor errors; the unit is that of the sensor.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={170,80,0}, pattern=LinePattern.Dash),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end SensorEffect;
