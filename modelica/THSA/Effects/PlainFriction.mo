within THSA.Effects;
block PlainFriction "Coulomb and viscous friction"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real F_C = 0 "Coulomb friction";
  parameter Real b = 0 "Viscous coefficient";
equation
  F = F_C*s + b*v;
  annotation(Documentation(info="<html><p>F_C sgn(v) + b v, the first two terms of equation 5: for a place that has no
friction of its own.</p></html>"));
end PlainFriction;
