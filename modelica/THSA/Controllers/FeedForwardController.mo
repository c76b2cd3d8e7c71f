within THSA.Controllers;
block FeedForwardController "Velocity loop: PI law with feed-forward of friction, load and inertia over temperature"
  THSA.Interfaces.RealInput reference(unit="rad/s") "Reference of the motor's speed";
  THSA.Interfaces.RealInput measurement(unit="rad/s") "Measured speed of the motor";
  THSA.Interfaces.RealInput T(unit="degC") "Measured temperature";
  THSA.Interfaces.RealInput F_hat(unit="N") "Estimated load, positive opposes positive velocity";
  THSA.Interfaces.RealOutput y(unit="A") "Current reference";
  parameter Real K_p(unit="A.s/rad", min=0, max=100) = 0.12 "Proportional gain";
  parameter Real K_i(unit="A/rad", min=0, max=1000) = 0.45 "Integral gain";
  parameter THSA.Units.Current I_max(min=0.001, max=1000) = 40 "Largest current reference";
  parameter THSA.Units.Current I_band(min=1e-9, max=10) = 0.04 "Band over which the integrator is faded out";
  parameter THSA.Units.Ratio f_f(min=0, max=2) = 1 "Share of the expected friction that is fed forward";
  parameter THSA.Units.Ratio f_F(min=0, max=2) = 1 "Share of the estimated load that is fed forward";
  parameter THSA.Units.Ratio f_J(min=0, max=2) = 1 "Share of the expected inertia that is fed forward";
  parameter THSA.Units.Time tau_r(min=1e-5, max=1) = 2e-3 "Time constant of the reference's derivative";
  parameter THSA.Units.AngularVelocity w_s(min=1e-6, max=100) = 0.2 "Reference at which the feed-forward is full";
  parameter THSA.Units.Ratio p(min=1, max=100) = 4 "Number of pole pairs";
  parameter THSA.Units.Inertia J(min=0, max=10) = 2.0e-3 "Expected moment of inertia";
  parameter THSA.Units.Ratio i(min=0.001, max=10000) = 30 "Gear ratio";
  parameter THSA.Units.Length P_h(min=1e-5, max=1) = 10e-3 "Lead of the screw";
  parameter THSA.Units.Ratio k_b(min=0, max=10) = 1.15 "Drag of the no-back device per torque of the aiding load";
  final parameter Real k(unit="m/rad") = P_h/(2*3.141592653589793) "Travel per angle";
  THSA.TemperatureLaw psi_pm(y(unit="Wb"), a0(unit="Wb") = 0.1, a1(unit="Wb/K") = 6e-5, a2(unit="Wb/K2") = -4e-6)
    "Expected flux";
  THSA.TemperatureLaw T_fm(y(unit="N.m"), alpha1(unit="N.m") = 1e-2, beta1 = -4e-2, alpha2(unit="N.m") = 3e-2,
    beta2 = 9e-3) "Expected Coulomb friction of the motor";
  THSA.TemperatureLaw b_m(y(unit="N.m.s/rad"), a0(unit="N.m.s/rad") = 4e-5, a1(unit="N.m.s/(rad.K)") = 2e-8,
    a2(unit="N.m.s/(rad.K2)") = 1e-8, a3(unit="N.m.s/(rad.K3)") = 1e-10) "Expected viscous friction of the motor";
  THSA.TemperatureLaw T_fg(y(unit="N.m"), a0(unit="N.m") = 11, a1(unit="N.m/K") = -0.25, a2(unit="N.m/K2") = 2e-4)
    "Expected Coulomb friction of the gearbox";
  THSA.TemperatureLaw F_fn(y(unit="N"), a0(unit="N") = 2.7e3, a1(unit="N/K") = 37, a2(unit="N/K2") = -1.4,
    a3(unit="N/K3") = -0.07) "Expected Coulomb friction of the nut";
  THSA.TemperatureLaw b_n(y(unit="N.s/m"), a0(unit="N.s/m") = 4e4, a1(unit="N.s/(m.K)") = -3e3,
    a2(unit="N.s/(m.K2)") = 230) "Expected viscous friction of the nut";
  Real e(unit="rad/s") "Control error";
  Real z(unit="rad", start=0, fixed=true, nominal=10) "Integral of the control error";
  Real r(unit="rad/s", start=0, fixed=true, nominal=10) "Delayed reference";
  Real s(unit="1") "Sign of the reference, faded in";
  THSA.Units.Torque tau_s "Expected torque at the screw";
  THSA.Units.Torque tau_nb "Expected drag of the no-back device";
  THSA.Units.Torque tau_m "Expected torque of the motor";
  Real y_ff(unit="A") "Feed-forward";
  Real y_pi(unit="A") "Output before the limit";
  Real h(unit="1") "Share of the error that is integrated: 1 free, 0 held";
equation
  connect(T, psi_pm.T);
  connect(T, T_fm.T);
  connect(T, b_m.T);
  connect(T, T_fg.T);
  connect(T, F_fn.T);
  connect(T, b_n.T);
  e = reference - measurement;
  tau_r*der(r) = reference - r;
  s = if reference > w_s then 1 elseif reference < -w_s then -1 else reference/w_s;
  tau_s = k*(f_f*(F_fn.y*s + b_n.y*k*reference/i) + f_F*F_hat*s^2);
  tau_nb = k_b*max(0, -tau_s*s)*s;
  tau_m = f_f*(T_fm.y*s + b_m.y*reference) + (tau_s + tau_nb + f_f*T_fg.y*s)/i + f_J*J*(reference - r)/tau_r;
  y_ff = tau_m/(sqrt(3/2)*p*psi_pm.y);
  y_pi = K_p*e + K_i*z + y_ff;
  y = if y_pi > I_max then I_max elseif y_pi < -I_max then -I_max else y_pi;
  h = if y_pi > I_max + I_band then 0 elseif y_pi > I_max then 1 - (y_pi - I_max)/I_band
    elseif y_pi < -I_max - I_band then 0 elseif y_pi < -I_max then 1 + (y_pi + I_max)/I_band else 1;
  der(z) = h*e;
  annotation(Documentation(info="<html>
<p>i_ref = K_p e + K_i &int;e dt + i_ff. The feed-forward is what the motor will need at the commanded speed: Coulomb
and viscous friction of motor, gearbox and nut by their laws over temperature, the load as far as it is known, the drag
of the no-back device that follows from it, and the inertia; divided by the torque constant at that temperature. With
the shares f_f, f_F and f_J at 0 it is <code>VelocityController</code>. The integrator is held while the output is
saturated, as in <code>LimitedPI</code>.</p>
<p>The laws are the controller's own: what the actuator was identified to be, not what it is.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,-100},{100,100}}, lineColor={0,0,127}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Line(points={{-80,-80},{-80,-20},{40,60},{80,60}}, color={0,0,127}),
      Text(extent={{-40,-20},{90,-80}}, textString="PI+FF", textColor={0,0,127})}));
end FeedForwardController;
