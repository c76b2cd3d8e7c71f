within THSA.Effects;
block LoadDependentFriction "Friction in proportion to the load that the pair carries"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real mu(unit="1", min=-1, max=1) = 0 "Friction per load";
equation
  F = mu*noEvent(abs(N))*s;
  annotation(Documentation(info="<html><p>mu |N| sgn(v).</p></html>"));
end LoadDependentFriction;
