within THSA.Interfaces;
connector BooleanOutput = output Boolean "'output Boolean' as connector"
  annotation(Icon(graphics={Polygon(points={{-100,100},{100,0},{-100,-100}}, lineColor={255,0,255}, fillColor={255,255,255}, fillPattern=FillPattern.Solid)}),
    Documentation(info="<html><p>Structure of <code>Modelica.Blocks.Interfaces.BooleanOutput</code>.</p></html>"));
