within THSA.Effects;
block AsymmetricFriction "Friction that differs with the direction"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real dF = 0 "Coulomb friction: half the difference of positive and negative direction";
  parameter Real db = 0 "Viscous coefficient: half the difference of positive and negative direction";
equation
  F = dF*noEvent(abs(s)) + db*v*s;
  annotation(Documentation(info="<html><p>F<sub>C</sub><sup>&plusmn;</sup> = F_C &plusmn; dF, b<sup>&plusmn;</sup> = b &plusmn; db.</p></html>"));
end AsymmetricFriction;
