within THSA;
block TemperatureLaw "Quantity over temperature: cubic polynomial plus two exponentials"
  THSA.Interfaces.RealInput T(unit="degC") "Temperature";
  THSA.Interfaces.RealOutput y "Quantity";
  parameter Real a0 = 0 "Constant coefficient";
  parameter Real a1 = 0 "Linear coefficient";
  parameter Real a2 = 0 "Quadratic coefficient";
  parameter Real a3 = 0 "Cubic coefficient";
  parameter Real alpha1 = 0 "Amplitude of the first exponential";
  parameter Real beta1(unit="1/K", min=-1, max=1) = 0 "Rate of the first exponential";
  parameter Real alpha2 = 0 "Amplitude of the second exponential";
  parameter Real beta2(unit="1/K", min=-1, max=1) = 0 "Rate of the second exponential";
equation
  y = a0 + T*(a1 + T*(a2 + T*a3)) + alpha1*exp(beta1*T) + alpha2*exp(beta2*T);
  annotation(
    Documentation(info="<html>
<p>y = a0 + a1 T + a2 T<sup>2</sup> + a3 T<sup>3</sup> + alpha1 exp(beta1 T) + alpha2 exp(beta2 T), T in degC.
Covers every form of tables II and III of the article. At a single temperature, a0 alone is the quantity when the
other coefficients are zero.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,-100},{100,100}}, lineColor={191,0,0}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Line(points={{-80,70},{-40,10},{20,-30},{80,-40}}, color={191,0,0}, smooth=Smooth.Bezier)}));
end TemperatureLaw;
