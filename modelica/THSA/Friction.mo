within THSA;
block Friction "Friction over sliding speed: Coulomb, breakaway with Stribeck decay, viscous and quadratic part"
  THSA.Interfaces.RealInput v "Sliding speed";
  THSA.Interfaces.RealInput F_C "Coulomb friction";
  THSA.Interfaces.RealInput b_v "Viscous coefficient";
  THSA.Interfaces.RealOutput F_f "Friction, in the direction of the sliding speed";
  THSA.Interfaces.RealOutput s(unit="1") "Regularised sign of the sliding speed";
  parameter THSA.Units.Ratio r_b(min=0.1, max=10) = 1 "Breakaway to Coulomb friction, F_b/F_C";
  parameter Real b_q = 0 "Quadratic coefficient";
  parameter Real v_S(min=1e-9) = 1 "Stribeck speed";
  parameter Real n(unit="1", min=0.1, max=10) = 2 "Exponent of the Stribeck decay";
  parameter Real v_r(min=1e-12) = 1e-6 "Half width of the regularised sign";
  Real stribeck(unit="1") "Breakaway part, relative to Coulomb friction";
equation
  s = if v > v_r then 1 elseif v < -v_r then -1 else v/v_r;
  stribeck = if r_b > 1 or r_b < 1 then (r_b - 1)*exp(-((v^2 + v_r^2)/v_S^2)^(n/2)) else 0;
  F_f = (F_C*(1 + stribeck) + b_q*v^2)*s + b_v*v;
  annotation(
    Documentation(info="<html>
<p>Equation 5 of the article: F_f = [F_C + b_v |v| + b_q v<sup>2</sup> + (F_b &minus; F_C)
exp(&minus;(|v|/v_S)<sup>n</sup>)] sgn(v). F_C and b_v are inputs because they drift with temperature; F_b is given
as its ratio to F_C. The sign is a straight line within &plusmn;v_r, so that a held load creeps at most at v_r; the
border is a state event. Units are those of the owner (N and m/s, or N.m and rad/s).</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,-100},{100,100}}, lineColor={0,0,0}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Line(points={{-80,-60},{0,-30},{0,30},{80,60}}, color={0,0,0})}));
end Friction;
