within THSA.Interfaces;
partial block PhaseEffect "Effect of the phases, which turns with the rotor"
  THSA.Interfaces.RealInput i_q(unit="A") "Current of the q axis";
  THSA.Interfaces.RealInput phi(unit="rad") "Angle of the rotor";
  THSA.Interfaces.RealOutput d(unit="A") "Added error of the current's reading";
  THSA.Interfaces.RealOutput du(unit="V") "Added voltage of the q axis";
  annotation(
    Documentation(info="<html><p>Place of errors of the phase currents' sensors and of the inverter's legs: in the q axis they repeat
with the electrical angle. A current loop uses the reading; the winding sees the commanded voltage plus du.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={170,80,0}, pattern=LinePattern.Dash),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end PhaseEffect;
