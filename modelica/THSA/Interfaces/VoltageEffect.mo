within THSA.Interfaces;
partial block VoltageEffect "Effect that adds to the inverter's voltage"
  THSA.Interfaces.RealInput i_q(unit="A") "Current of the q axis";
  input Real phi(unit="rad") = 0 "Angle of the rotor; 0 where the model does not give it";
  THSA.Interfaces.RealOutput du(unit="V") "Added voltage";
  annotation(
    Documentation(info="<html><p>Place of inverter effects: the winding sees the commanded voltage plus du.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={170,80,0}, pattern=LinePattern.Dash),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end VoltageEffect;
