within THSA.Controllers;
block Delay "Short delay of a sampled controller"
  THSA.Interfaces.RealInput u "Signal";
  THSA.Interfaces.RealOutput y "Delayed signal";
  parameter THSA.Units.Time tau(min=1e-6, max=1) = 1e-3 "Delay";
  Real z(start=0, fixed=true) "Mean of the signal and the delayed signal";
equation
  tau*der(z) = 2*(u - z);
  y = 2*z - u;
  annotation(
    Documentation(info="<html><p>Pad&eacute; approximation of order (1, 1), exp(&minus;s &tau;) &asymp;
(1 &minus; s&tau;/2)/(1 + s&tau;/2). Its phase is off by (&omega;&tau;)<sup>3</sup>/12: meant for delays of a few samples
of a controller, far below the period of what passes through.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,-100},{100,100}}, lineColor={0,0,127}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-80,40},{80,-40}}, textString="delay", textColor={0,0,127})}));
end Delay;
