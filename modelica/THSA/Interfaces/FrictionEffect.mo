within THSA.Interfaces;
partial block FrictionEffect "Effect that adds to the friction of a sliding pair"
  THSA.Interfaces.RealInput v "Sliding speed";
  THSA.Interfaces.RealInput s(unit="1") "Regularised sign of the sliding speed";
  THSA.Interfaces.RealInput z "Position of the pair";
  THSA.Interfaces.RealInput N "Load that the pair carries";
  THSA.Interfaces.RealOutput F "Added friction, positive opposes positive speed";
  annotation(
    Documentation(info="<html><p>Place of an effect at motor, gearbox or nut. Units are those of the owner: rad/s, rad and N.m at a shaft;
m/s, m and N at the nut. N is the electromagnetic torque at the motor, the screw's torque at the gearbox, the
contact force at the nut.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={170,80,0}, pattern=LinePattern.Dash),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end FrictionEffect;
