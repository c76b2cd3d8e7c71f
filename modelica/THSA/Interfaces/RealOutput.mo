within THSA.Interfaces;
connector RealOutput = output Real "'output Real' as connector"
  annotation(Icon(graphics={Polygon(points={{-100,100},{100,0},{-100,-100}}, lineColor={0,0,127}, fillColor={255,255,255}, fillPattern=FillPattern.Solid)}),
    Documentation(info="<html><p>Structure of <code>Modelica.Blocks.Interfaces.RealOutput</code>.</p></html>"));
