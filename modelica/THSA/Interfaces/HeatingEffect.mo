within THSA.Interfaces;
partial block HeatingEffect "Effect that warms the motor"
  THSA.Interfaces.RealInput P(unit="W") "Copper loss";
  THSA.Interfaces.RealOutput g_R(unit="1") "Relative change of the winding resistance";
  THSA.Interfaces.RealOutput g_psi(unit="1") "Relative change of the magnets' flux";
  annotation(
    Documentation(info="<html><p>Place of thermal networks of the motor.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={170,80,0}, pattern=LinePattern.Dash),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end HeatingEffect;
