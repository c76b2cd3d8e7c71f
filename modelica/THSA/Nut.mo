within THSA;
model Nut "Nut: friction of the screw against the housing"
  THSA.Interfaces.TranslationalFlange flange_a "Screw's side";
  THSA.Interfaces.TranslationalFlange flange_b "Output";
  THSA.Interfaces.RealInput T(unit="degC") "Temperature of the lubricant";
  input THSA.Units.Force F_f = 0 "Added friction force";
  THSA.TemperatureLaw F_fn(y(unit="N"),
    a0(unit="N", min=-1e6, max=1e6) = 2.7e3, a1(unit="N/K", min=-1e5, max=1e5) = 37,
    a2(unit="N/K2", min=-1e4, max=1e4) = -1.4, a3(unit="N/K3", min=-1e3, max=1e3) = -0.07,
    alpha1(unit="N", min=-1e6, max=1e6), alpha2(unit="N", min=-1e6, max=1e6)) "Coulomb friction force";
  THSA.TemperatureLaw b_n(y(unit="N.s/m"),
    a0(unit="N.s/m", min=-1e8, max=1e8) = 4e4, a1(unit="N.s/(m.K)", min=-1e7, max=1e7) = -3e3,
    a2(unit="N.s/(m.K2)", min=-1e6, max=1e6) = 230, a3(unit="N.s/(m.K3)", min=-1e5, max=1e5),
    alpha1(unit="N.s/m", min=-1e8, max=1e8), alpha2(unit="N.s/m", min=-1e8, max=1e8)) "Viscous friction coefficient";
  THSA.Friction friction(v(unit="m/s"), F_C(unit="N"), b_v(unit="N.s/m"), F_f(unit="N"),
    b_q(unit="N.s2/m2", min=-1e9, max=1e9), v_S(unit="m/s", max=1) = 1e-3, v_r(unit="m/s", max=1e-3) = 1e-8)
    "Friction of screw and nut";
  THSA.Units.Velocity v "Speed of the nut";
  THSA.Units.Power P_f "Friction loss";
equation
  connect(T, F_fn.T);
  connect(T, b_n.T);
  connect(F_fn.y, friction.F_C);
  connect(b_n.y, friction.b_v);
  flange_a.s = flange_b.s;
  v = der(flange_b.s);
  friction.v = v;
  flange_a.f + flange_b.f - friction.F_f - F_f = 0;
  P_f = (friction.F_f + F_f)*v;
  annotation(
    Documentation(info="<html><p>F_fn sgn(v) + b_n v between the two flanges. The coefficients of the laws are those of
table III.</p></html>"),
    Icon(graphics={Rectangle(extent={{-40,60},{40,-60}}, lineColor={0,0,0}, fillColor={200,200,200}, fillPattern=FillPattern.Solid),
      Line(points={{-60,-80},{60,-80}}, color={0,0,0}),
      Text(extent={{-100,100},{100,65}}, textString="%name", textColor={0,0,255})}));
end Nut;
