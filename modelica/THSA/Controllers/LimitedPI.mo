within THSA.Controllers;
partial block LimitedPI "PI law with limited output whose integrator is held while the output is saturated"
  THSA.Interfaces.RealInput reference "Reference";
  THSA.Interfaces.RealInput measurement "Measured value";
  THSA.Interfaces.RealOutput y "Limited output";
  Real e "Control error";
  Real z(start=0, fixed=true) "Integral of the control error";
  Real y_pi "Output before the limit";
  Real h(unit="1") "Share of the error that is integrated: 1 free, 0 held";
protected
  Real k_p "Proportional gain";
  Real k_i "Integral gain";
  Real y_max "Limit";
  Real band "Band beyond the limit over which the integrator is faded out";
equation
  e = reference - measurement;
  y_pi = k_p*e + k_i*z;
  y = if y_pi > y_max then y_max elseif y_pi < -y_max then -y_max else y_pi;
  h = if y_pi > y_max + band then 0 elseif y_pi > y_max then 1 - (y_pi - y_max)/band
    elseif y_pi < -y_max - band then 0 elseif y_pi < -y_max then 1 + (y_pi + y_max)/band else 1;
  der(z) = h*e;
  annotation(Documentation(info="<html>
<p>The integrator is held while the output is saturated. It is faded out over a narrow band beyond the limit instead
of being switched: a switched hold chatters where integrating drives the output into the limit and holding lets it
fall out again; within the band the law slides as the averaged switching would (Filippov).</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,-100},{100,100}}, lineColor={0,0,127}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Line(points={{-80,-80},{-80,-20},{40,60},{80,60}}, color={0,0,127}),
      Text(extent={{-20,-20},{90,-80}}, textString="PI", textColor={0,0,127})}));
end LimitedPI;
