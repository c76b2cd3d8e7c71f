within THSA.Effects;
block FrictionRunIn "Coulomb friction that falls with the distance travelled"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real dF = 0 "Friction at the start above the friction after run-in";
  parameter Real d_r(min=1e-9) = 1 "Distance over which it falls to 1/e";
  Real d(start=0, fixed=true, nominal=1e-2) "Distance travelled; at rest without the effect";
equation
  der(d) = if dF > 0 or dF < 0 then noEvent(abs(v)) else 0;
  F = if dF > 0 or dF < 0 then dF*exp(-d/d_r)*s else 0;
  annotation(Documentation(info="<html><p>dF exp(&minus;d/d_r) sgn(v) with d the distance since the start: the lubricant is worked in.</p></html>"));
end FrictionRunIn;
