within THSA.Interfaces;
partial block ShaftEffect "Effect that adds to the torque of a shaft"
  THSA.Interfaces.RealInput phi(unit="rad") "Angle of the shaft";
  THSA.Interfaces.RealInput w(unit="rad/s") "Speed of the shaft";
  THSA.Interfaces.RealInput T(unit="N.m") "Torque of the shaft without the effect, positive opposes positive speed";
  THSA.Interfaces.RealOutput tau(unit="N.m") "Added torque, positive opposes positive speed";
  annotation(
    Documentation(info="<html><p>Place of torques at the screw's shaft, between screw and no-back device.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={170,80,0}, pattern=LinePattern.Dash),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end ShaftEffect;
