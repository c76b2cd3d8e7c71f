within THSA.Effects;
block Windage "Drag that grows with a power of the speed"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real b_q = 0 "Quadratic coefficient, at the speed v_r if the exponent is not 2";
  parameter Real n(unit="1", min=1, max=4) = 2 "Exponent";
  parameter Real v_r(min=1e-9) = 1 "Speed at which drags of all exponents are the same";
equation
  F = if b_q > 0 or b_q < 0 then b_q*v^2*((v^2 + 1e-12*v_r^2)/v_r^2)^((n - 2)/2)*s else 0;
  annotation(Documentation(info="<html><p>b_q v<sup>2</sup> (|v|/v_r)<sup>n&minus;2</sup> sgn(v); with n = 2 the quadratic
term of equation 5. Drag in a turbulent gap grows with the power 1.8.</p></html>"));
end Windage;
