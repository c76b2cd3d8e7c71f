within THSA.Effects;
block EmpiricalRise "A local rise over the position, for friction that no effect with a name explains"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real k_b = 0 "Coefficient of exp(-((z - z_b)/w_b)^2/2) sgn(v)";
  parameter Real z_b = 0 "Position of the rise";
  parameter Real w_b(min=1e-9) = 1 "Its width (standard deviation)";
equation
  F = if k_b > 0 or k_b < 0 then k_b*exp(-0.5*((z - z_b)/w_b)^2)*s else 0;
  annotation(Documentation(info="<html><p>No physics is meant by it: terms are chosen by what the recordings show, one coefficient
each.</p></html>"));
end EmpiricalRise;
