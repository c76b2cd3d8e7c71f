within THSA.Effects;
block LoadDependentFriction "Friction in proportion to the load that the pair carries"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real mu(unit="1", min=-1, max=1) = 0 "Friction per load";
  parameter Real mu_S(unit="1", min=-1, max=1) = 0 "Breakaway part of the friction per load";
  parameter Real v_S(min=1e-9) = 1 "Stribeck speed";
  parameter Real mu_2 = 0 "Growth of the friction per load with the load";
equation
  F = (mu + (if mu_S > 0 or mu_S < 0 then mu_S*exp(-(v/v_S)^2) else 0) + mu_2*noEvent(abs(N)))*noEvent(abs(N))*s;
  annotation(Documentation(info="<html><p>(mu + mu_S exp(&minus;(v/v_S)<sup>2</sup>) + mu_2 |N|) |N| sgn(v): gears and screws lose a share of
the load, more of it as sliding begins, and more of it where the load squeezes out the lubricant.</p></html>"));
end LoadDependentFriction;
