within THSA.Effects;
block FrictionRunInTime "Coulomb friction that falls with the time since the start"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real dF = 0 "Friction at the start above the friction after run-in";
  parameter Real tau_r(unit="s", min=1e-6) = 1 "Time over which it falls to 1/e";
  Real r(unit="1", start=1, fixed=true) "Share that is left; at rest without the effect";
equation
  der(r) = if dF > 0 or dF < 0 then -r/tau_r else 0;
  F = dF*r*s;
  annotation(Documentation(info="<html><p>dF exp(&minus;t/tau_r) sgn(v): the lubricant warms or is spread whether or not the pair
travels.</p></html>"));
end FrictionRunInTime;
