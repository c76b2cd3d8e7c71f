within THSA.Effects;
block PositionFriction "Friction that varies along the stroke"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real c1 = 0 "Change of Coulomb friction per length";
  parameter Real c2 = 0 "Height of a local rise of Coulomb friction";
  parameter Real z_2 = 0 "Position of the rise";
  parameter Real w_2(min=1e-9) = 1 "Width of the rise (standard deviation)";
  parameter Real c_s = 0 "Amplitude of a wave of Coulomb friction, sine part";
  parameter Real c_c = 0 "Amplitude of a wave of Coulomb friction, cosine part";
  parameter Real kappa = 1 "Wave number";
equation
  F = (c1*z + (if c2 > 0 or c2 < 0 then c2*exp(-0.5*((z - z_2)/w_2)^2) else 0)
    + (if c_s > 0 or c_s < 0 or c_c > 0 or c_c < 0 then c_s*sin(kappa*z) + c_c*cos(kappa*z) else 0))*s;
  annotation(Documentation(info="<html><p>Coulomb friction with a slope, a local rise and a wave over the position.</p></html>"));
end PositionFriction;
