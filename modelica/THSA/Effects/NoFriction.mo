within THSA.Effects;
block NoFriction "No added friction"
  extends THSA.Interfaces.FrictionEffect;
equation
  F = 0;
  annotation(Documentation(info="<html><p>Default of the friction slots.</p></html>"));
end NoFriction;
