within THSA.Effects;
block Windage "Drag with the square of the speed"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real b_q = 0 "Quadratic coefficient";
equation
  F = b_q*v^2*s;
  annotation(Documentation(info="<html><p>b_q v<sup>2</sup> sgn(v), the quadratic term of equation 5.</p></html>"));
end Windage;
