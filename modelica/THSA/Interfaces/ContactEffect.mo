within THSA.Interfaces;
partial block ContactEffect "Effect in the contact of screw and nut"
  THSA.Interfaces.RealInput phi(unit="rad") "Angle of the screw";
  THSA.Interfaces.RealInput w(unit="rad/s") "Speed of the screw";
  THSA.Interfaces.RealInput delta(unit="m") "Deflection of the contact without the effect";
  THSA.Interfaces.RealInput v_s(unit="m/s") "Its rate";
  input Real t_d(unit="s") = 0 "Damping over stiffness of the contact; 0 where the model does not give it";
  THSA.Interfaces.RealOutput e(unit="m") "Added deflection";
  THSA.Interfaces.RealOutput v_e(unit="m/s") "Its rate";
  THSA.Interfaces.RealOutput k_e(unit="m/rad") "Its change with the screw's angle";
  annotation(
    Documentation(info="<html><p>Place of clearances and lead errors: the contact force follows from delta + e and v_s + v_e,
the screw's torque from k + k_e.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={170,80,0}, pattern=LinePattern.Dash),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end ContactEffect;
