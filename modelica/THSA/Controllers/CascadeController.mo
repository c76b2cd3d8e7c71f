within THSA.Controllers;
block CascadeController "Sampled position loop around a velocity loop, both proportional"
  THSA.Interfaces.RealInput reference(unit="m") "Reference of the position";
  THSA.Interfaces.RealInput q(unit="m") "Measured position";
  THSA.Interfaces.RealInput v(unit="m/s") "Velocity";
  THSA.Interfaces.RealOutput y(unit="V") "Voltage as the controller computes it";
  THSA.Interfaces.RealOutput y_held(unit="V") "Voltage at the motor, held over a sample";
  parameter Real k_p(unit="1/s", min=0, max=1e5) = 160.18 "Gain of the position loop";
  parameter Real k_v(unit="V.s/m", min=0, max=1e6) = 243.45 "Gain of the velocity loop";
  parameter THSA.Units.Voltage U_max(min=1e-3, max=1e4) = 10 "Largest voltage";
  parameter THSA.Units.Time T_s(min=1e-5, max=0.1) = 1e-3 "Sampling period";
  THSA.Controllers.Delay difference(u(unit="m/s"), y(unit="m/s"), z(unit="m/s"), tau=T_s) "Velocity from two samples";
  THSA.Controllers.Delay hold(u(unit="V"), y(unit="V"), z(unit="V"), tau=T_s/2) "Hold over a sample";
  THSA.Units.Voltage y_p "Voltage before the limit";
equation
  connect(v, difference.u);
  y_p = k_v*(k_p*(reference - q) - difference.y);
  y = if y_p > U_max then U_max elseif y_p < -U_max then -U_max else y_p;
  connect(y, hold.u);
  connect(hold.y, y_held);
  annotation(
    Documentation(info="<html>
<p>Stands for the sampled law y<sub>k</sub> = k_v (k_p (reference<sub>k</sub> &minus; q<sub>k</sub>) &minus;
(q<sub>k</sub> &minus; q<sub>k&minus;2</sub>)/(2 T_s)), limited to &plusmn;U_max and held until the next sample. What sampling
does at the frequencies of the loop is delay: the difference over two samples is the velocity one sample ago, and the
held voltage acts half a sample late on average.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,-100},{100,100}}, lineColor={0,0,127}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-80,40},{80,-40}}, textString="P-P", textColor={0,0,127})}));
end CascadeController;
