within THSA.Thermal;
model ThermalConductor "Lumped conductance between two heat ports"
  THSA.Interfaces.HeatPort port_a "Heat port";
  THSA.Interfaces.HeatPort port_b "Heat port";
  parameter THSA.Units.ThermalConductance G(min=0, max=1e6) = 1 "Conductance";
equation
  port_a.Q_flow = G*(port_a.T - port_b.T);
  port_a.Q_flow + port_b.Q_flow = 0;
  annotation(
    Documentation(info="<html><p>Q_flow = G (T_a &minus; T_b), as
<code>Modelica.Thermal.HeatTransfer.Components.ThermalConductor</code>.</p></html>"),
    Icon(graphics={Rectangle(extent={{-80,40},{80,-40}}, lineColor={191,0,0}, fillColor={235,220,220}, fillPattern=FillPattern.Solid),
      Text(extent={{-60,30},{60,-30}}, textString="G"),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end ThermalConductor;
