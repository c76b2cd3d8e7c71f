within THSA.Effects;
block LoadDependentFriction "Friction in proportion to the load that the pair carries"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real mu(unit="1", min=-20, max=20) = 0 "Friction per load";
  parameter Real mu_S(unit="1", min=-20, max=20) = 0 "Breakaway part of the friction per load";
  parameter Real v_S(min=1e-9) = 1 "Stribeck speed";
  parameter Real n_S(unit="1", min=0.1, max=10) = 2 "Exponent of the decay of the breakaway part";
  parameter Real mu_v = 0 "Growth of the friction per load with the speed";
  parameter Real mu_2 = 0 "Growth of the friction per load with the load";
  parameter Real mu_D(unit="1", min=-20, max=20) = 0 "Friction per load: half the difference of driving and driven";
  parameter Real mu_A(unit="1", min=-20, max=20) = 0 "Friction per load: half the difference of positive and negative load";
equation
  F = ((mu + (if mu_S > 0 or mu_S < 0 then mu_S*exp(-((v^2 + 1e-12*v_S^2)/v_S^2)^(n_S/2)) else 0) + mu_v*v*s + mu_2*noEvent(abs(N)))
    *noEvent(abs(N)) + mu_A*N)*s + mu_D*N*noEvent(abs(s));
  annotation(Documentation(info="<html><p>(mu + mu_S exp(&minus;(|v|/v_S)<sup>n_S</sup>) + mu_v |v| + mu_2 |N|) |N| sgn(v) + mu_A N sgn(v)
+ mu_D N |sgn(v)|: gears and threads lose a share of the load, more of it as sliding begins, more of it where the load
squeezes out the lubricant, another share where the load drives than where it is driven (efficiencies 1/(1 + mu + mu_D) and
1 &minus; mu + mu_D), and another on the other flank.</p></html>"));
end LoadDependentFriction;
