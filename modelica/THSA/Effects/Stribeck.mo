within THSA.Effects;
block Stribeck "Friction that falls from breakaway to Coulomb friction as sliding begins"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real dF = 0 "Breakaway above Coulomb friction, F_b - F_C";
  parameter Real v_S(min=1e-9) = 1 "Stribeck speed";
  parameter Real n(unit="1", min=0.1, max=10) = 2 "Exponent of the decay";
equation
  F = if dF > 0 or dF < 0 then dF*exp(-((v^2 + 1e-12*v_S^2)/v_S^2)^(n/2))*s else 0;
  annotation(Documentation(info="<html><p>(F_b &minus; F_C) exp(&minus;(|v|/v_S)<sup>n</sup>) sgn(v), the third term of equation 5.</p></html>"));
end Stribeck;
