within THSA;
model Motor "Permanent-magnet synchronous motor in the power-invariant dq frame, with rotor and friction"
  THSA.Interfaces.RealInput u_q(unit="V") "Voltage of the q axis";
  THSA.Interfaces.RealInput T(unit="degC") "Temperature of magnets and bearings, and of the winding unless T_w is given";
  THSA.Interfaces.RealOutput i_q(unit="A", start=0, fixed=true, nominal=10) "Current of the q axis";
  THSA.Interfaces.RealOutput w_m(unit="rad/s", start=0, fixed=true, nominal=10) "Speed of the rotor";
  THSA.Interfaces.RotationalFlange flange "Shaft";
  input THSA.Units.Temperature T_w = T "Temperature of the winding";
  input THSA.Units.Voltage du = 0 "Voltage that the inverter adds";
  input THSA.Units.Ratio g_R = 0 "Relative change of the winding resistance";
  input THSA.Units.Ratio g_psi = 0 "Relative change of the magnets' flux";
  input THSA.Units.Ratio g_t = 0 "Relative change of the torque constant";
  input THSA.Units.Ratio g_e = 0 "Relative change of the back-EMF constant";
  input THSA.Units.Torque tau_f = 0 "Added friction torque";
  parameter THSA.Units.Ratio p(min=1, max=100) = 4 "Number of pole pairs";
  parameter THSA.Units.Inductance L(min=1e-6, max=1) = 2.0e-3 "Inductance of the q axis";
  parameter THSA.Units.Inertia J(min=1e-7, max=10) = 2.0e-3 "Moment of inertia of the rotor";
  THSA.TemperatureLaw R_s(y(unit="Ohm"),
    a0(unit="Ohm", min=-100, max=100) = 1.2, a1(unit="Ohm/K", min=-1, max=1) = 3e-2,
    a2(unit="Ohm/K2", min=-0.1, max=0.1) = 7e-5, a3(unit="Ohm/K3", min=-0.01, max=0.01) = -5e-6,
    alpha1(unit="Ohm", min=-100, max=100), alpha2(unit="Ohm", min=-100, max=100)) "Winding resistance";
  THSA.TemperatureLaw psi_pm(y(unit="Wb"),
    a0(unit="Wb", min=-10, max=10) = 0.1, a1(unit="Wb/K", min=-0.1, max=0.1) = 6e-5,
    a2(unit="Wb/K2", min=-0.01, max=0.01) = -4e-6, a3(unit="Wb/K3", min=-0.001, max=0.001),
    alpha1(unit="Wb", min=-10, max=10), alpha2(unit="Wb", min=-10, max=10)) "Flux of the permanent magnets";
  THSA.TemperatureLaw T_fm(y(unit="N.m"),
    a0(unit="N.m", min=-100, max=100), a1(unit="N.m/K", min=-10, max=10), a2(unit="N.m/K2", min=-1, max=1),
    a3(unit="N.m/K3", min=-0.1, max=0.1), alpha1(unit="N.m", min=-100, max=100) = 1e-2, beta1 = -4e-2,
    alpha2(unit="N.m", min=-100, max=100) = 3e-2, beta2 = 9e-3) "Coulomb friction torque";
  THSA.TemperatureLaw b_m(y(unit="N.m.s/rad"),
    a0(unit="N.m.s/rad", min=-1, max=1) = 4e-5, a1(unit="N.m.s/(rad.K)", min=-0.1, max=0.1) = 2e-8,
    a2(unit="N.m.s/(rad.K2)", min=-0.01, max=0.01) = 1e-8, a3(unit="N.m.s/(rad.K3)", min=-0.001, max=0.001) = 1e-10,
    alpha1(unit="N.m.s/rad", min=-1, max=1), alpha2(unit="N.m.s/rad", min=-1, max=1)) "Viscous friction coefficient";
  THSA.Friction friction(v(unit="rad/s"), F_C(unit="N.m"), b_v(unit="N.m.s/rad"), F_f(unit="N.m"),
    b_q(unit="N.m.s2/rad2", min=-1, max=1), v_S(unit="rad/s", max=1000) = 10, v_r(unit="rad/s", max=10) = 3e-4)
    "Friction of the bearings";
  THSA.Units.Angle phi(start=0, fixed=true, nominal=10) "Angle of the rotor";
  THSA.Units.TorqueConstant K_t "Torque constant";
  THSA.Units.Torque tau_e "Electromagnetic torque";
  THSA.Units.Power P_co "Copper loss";
  THSA.Units.Power P_f "Friction loss";
equation
  R_s.T = T_w;
  connect(T, psi_pm.T);
  connect(T, T_fm.T);
  connect(T, b_m.T);
  connect(T_fm.y, friction.F_C);
  connect(b_m.y, friction.b_v);
  connect(w_m, friction.v);
  phi = flange.phi;
  w_m = der(phi);
  K_t = sqrt(3/2)*p*psi_pm.y*(1 + g_psi);
  L*der(i_q) = u_q + du - R_s.y*(1 + g_R)*i_q - K_t*(1 + g_e)*w_m;
  tau_e = K_t*(1 + g_t)*i_q;
  J*der(w_m) = tau_e - friction.F_f - tau_f + flange.tau;
  P_co = R_s.y*(1 + g_R)*i_q^2;
  P_f = (friction.F_f + tau_f)*w_m;
  annotation(
    Documentation(info="<html>
<p>L di_q/dt = u_q &minus; R_s i_q &minus; K_t &omega;_m, K_t = &radic;(3/2) p &psi;_pm (equation 4),
J d&omega;_m/dt = K_t i_q &minus; friction &minus; load; copper loss P_co = R_s i_q<sup>2</sup> (equation 2). The
coefficients of the laws are those of table II.</p></html>"),
    Icon(graphics={Rectangle(extent={{-80,60},{60,-60}}, lineColor={0,0,0}, fillColor={128,128,255}, fillPattern=FillPattern.HorizontalCylinder),
      Rectangle(extent={{60,10},{100,-10}}, lineColor={0,0,0}, fillColor={160,160,164}, fillPattern=FillPattern.HorizontalCylinder),
      Text(extent={{-100,100},{100,65}}, textString="%name", textColor={0,0,255})}));
end Motor;
