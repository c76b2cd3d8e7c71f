within THSA.Interfaces;
partial block TorqueConstantEffect "Effect on torque constant and back-EMF"
  THSA.Interfaces.RealInput i_q(unit="A") "Current of the q axis";
  THSA.Interfaces.RealOutput g_t(unit="1") "Relative change of the torque constant";
  THSA.Interfaces.RealOutput g_e(unit="1") "Relative change of the back-EMF constant";
  annotation(
    Documentation(info="<html><p>Place of saturation.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={170,80,0}, pattern=LinePattern.Dash),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end TorqueConstantEffect;
