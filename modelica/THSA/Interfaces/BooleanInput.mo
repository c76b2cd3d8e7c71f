within THSA.Interfaces;
connector BooleanInput = input Boolean "'input Boolean' as connector"
  annotation(Icon(graphics={Polygon(points={{-100,100},{100,0},{-100,-100}}, lineColor={255,0,255}, fillColor={255,0,255}, fillPattern=FillPattern.Solid)}),
    Documentation(info="<html><p>Structure of <code>Modelica.Blocks.Interfaces.BooleanInput</code>.</p></html>"));
