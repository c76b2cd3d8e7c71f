within THSA.Interfaces;
connector RotationalFlange "One-dimensional rotational flange"
  THSA.Units.Angle phi "Absolute rotation angle of the flange";
  flow THSA.Units.Torque tau "Cut torque in the flange";
  annotation(Icon(graphics={Ellipse(extent={{-100,100},{100,-100}}, lineColor={0,0,0}, fillColor={95,95,95}, fillPattern=FillPattern.Solid)}),
    Documentation(info="<html><p>Structure of <code>Modelica.Mechanics.Rotational.Interfaces.Flange_a</code>.</p></html>"));
end RotationalFlange;
