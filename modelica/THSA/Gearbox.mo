within THSA;
model Gearbox "Reduction gear with its losses at the output shaft"
  THSA.Interfaces.RotationalFlange flange_a "Shaft on the motor's side";
  THSA.Interfaces.RotationalFlange flange_b "Shaft on the screw's side";
  THSA.Interfaces.RealInput T(unit="degC") "Temperature of the lubricant";
  input THSA.Units.Torque tau_f = 0 "Added friction torque at the output shaft";
  parameter THSA.Units.Ratio i(min=0.001, max=10000) = 30 "Gear ratio, motor to screw";
  THSA.TemperatureLaw T_fg(y(unit="N.m"),
    a0(unit="N.m", min=-1e4, max=1e4) = 11, a1(unit="N.m/K", min=-1000, max=1000) = -0.25,
    a2(unit="N.m/K2", min=-100, max=100) = 2e-4, a3(unit="N.m/K3", min=-10, max=10),
    alpha1(unit="N.m", min=-1e4, max=1e4), alpha2(unit="N.m", min=-1e4, max=1e4)) "Coulomb friction torque";
  THSA.TemperatureLaw b_g(y(unit="N.m.s/rad"),
    a0(unit="N.m.s/rad", min=-100, max=100) = -6e-7, a1(unit="N.m.s/(rad.K)", min=-10, max=10) = 1.8e-7,
    a2(unit="N.m.s/(rad.K2)", min=-1, max=1), a3(unit="N.m.s/(rad.K3)", min=-0.1, max=0.1),
    alpha1(unit="N.m.s/rad", min=-100, max=100), alpha2(unit="N.m.s/rad", min=-100, max=100))
    "Viscous friction coefficient";
  THSA.Friction friction(v(unit="rad/s"), F_C(unit="N.m"), b_v(unit="N.m.s/rad"), F_f(unit="N.m"),
    b_q(unit="N.m.s2/rad2", min=-1000, max=1000), v_S(unit="rad/s", max=1000) = 1, v_r(unit="rad/s", max=1) = 1e-5)
    "Friction of the gear train";
  THSA.Units.AngularVelocity w_g "Speed of the output shaft";
  THSA.Units.Power P_f "Friction loss";
equation
  connect(T, T_fg.T);
  connect(T, b_g.T);
  connect(T_fg.y, friction.F_C);
  connect(b_g.y, friction.b_v);
  flange_a.phi = i*flange_b.phi;
  w_g = der(flange_b.phi);
  friction.v = w_g;
  0 = i*flange_a.tau + flange_b.tau - friction.F_f - tau_f;
  P_f = (friction.F_f + tau_f)*w_g;
  annotation(
    Documentation(info="<html><p>T_g = T_s + T_nb + T_fg sgn(&omega;_g) + b_g &omega;_g at the output shaft, T_g/i at
the motor. The coefficients of the laws are those of table III.</p></html>"),
    Icon(graphics={Rectangle(extent={{-40,80},{-20,-80}}, lineColor={0,0,0}, fillColor={192,192,192}, fillPattern=FillPattern.HorizontalCylinder),
      Rectangle(extent={{20,40},{40,-40}}, lineColor={0,0,0}, fillColor={192,192,192}, fillPattern=FillPattern.HorizontalCylinder),
      Text(extent={{-100,120},{100,85}}, textString="%name", textColor={0,0,255})}));
end Gearbox;
