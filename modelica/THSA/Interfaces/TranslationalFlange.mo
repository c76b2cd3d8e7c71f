within THSA.Interfaces;
connector TranslationalFlange "One-dimensional translational flange"
  THSA.Units.Position s "Absolute position of the flange";
  flow THSA.Units.Force f "Cut force directed into the flange";
  annotation(Icon(graphics={Rectangle(extent={{-100,-100},{100,100}}, lineColor={0,127,0}, fillColor={0,127,0}, fillPattern=FillPattern.Solid)}),
    Documentation(info="<html><p>Structure of <code>Modelica.Mechanics.Translational.Interfaces.Flange_a</code>.</p></html>"));
end TranslationalFlange;
