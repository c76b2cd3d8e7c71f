within THSA.Thermal;
model PrescribedHeatFlow "A loss that enters a heat port"
  THSA.Interfaces.RealInput P(unit="W") "Loss";
  THSA.Interfaces.HeatPort port "Heat port";
equation
  port.Q_flow = -P;
  annotation(
    Documentation(info="<html><p>As <code>Modelica.Thermal.HeatTransfer.Sources.PrescribedHeatFlow</code>.</p></html>"),
    Icon(graphics={Line(points={{-80,0},{60,0}}, color={191,0,0}, thickness=0.5),
      Polygon(points={{60,20},{60,-20},{90,0},{60,20}}, lineColor={191,0,0}, fillColor={191,0,0}, fillPattern=FillPattern.Solid),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end PrescribedHeatFlow;
