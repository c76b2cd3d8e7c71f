within THSA.Effects;
block ShearThinning "Viscous friction that levels off with speed"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real dF = 0 "Friction at high speed above that at low speed";
  parameter Real v_0(min=1e-9) = 1 "Speed at which it levels off";
equation
  F = if dF > 0 or dF < 0 then dF*(1 - exp(-(v/v_0)^2))*s else 0;
  annotation(Documentation(info="<html><p>dF (1 &minus; exp(&minus;(v/v_0)<sup>2</sup>)) sgn(v).</p></html>"));
end ShearThinning;
