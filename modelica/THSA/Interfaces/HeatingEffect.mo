within THSA.Interfaces;
partial block HeatingEffect "Effect that warms the winding"
  THSA.Interfaces.RealInput P(unit="W") "Copper loss";
  THSA.Interfaces.RealOutput dT(unit="K") "Temperature of the winding above that of the box";
  annotation(
    Documentation(info="<html><p>Place of thermal networks of the motor.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={170,80,0}, pattern=LinePattern.Dash),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end HeatingEffect;
