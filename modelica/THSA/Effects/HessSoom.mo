within THSA.Effects;
block HessSoom "Friction that falls from breakaway to Coulomb friction as a fraction of the speed"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real dF = 0 "Breakaway above Coulomb friction, F_b - F_C";
  parameter Real v_S(min=1e-9) = 1 "Speed at which half of it is left";
equation
  F = if dF > 0 or dF < 0 then dF/(1 + (v/v_S)^2)*s else 0;
  annotation(Documentation(info="<html><p>(F_b &minus; F_C)/(1 + (v/v_S)<sup>2</sup>) sgn(v): a Stribeck curve whose tail is longer
than that of an exponential.</p></html>"));
end HessSoom;
