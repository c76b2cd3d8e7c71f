within THSA.Interfaces;
connector RealInput = input Real "'input Real' as connector"
  annotation(Icon(graphics={Polygon(points={{-100,100},{100,0},{-100,-100}}, lineColor={0,0,127}, fillColor={0,0,127}, fillPattern=FillPattern.Solid)}),
    Documentation(info="<html><p>Structure of <code>Modelica.Blocks.Interfaces.RealInput</code>.</p></html>"));
