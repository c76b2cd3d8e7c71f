within THSA;
model RigidScrew "Roller screw without contact compliance"
  THSA.Interfaces.RotationalFlange flange_a "Screw shaft";
  THSA.Interfaces.TranslationalFlange flange_b "Nut";
  parameter THSA.Units.Length P_h(min=1e-5, max=1) = 10e-3 "Lead";
  final parameter Real k(unit="m/rad") = P_h/(2*3.141592653589793) "Travel per angle";
equation
  flange_b.s = k*flange_a.phi;
  flange_a.tau + k*flange_b.f = 0;
  annotation(
    Documentation(info="<html><p>x = k &theta;_g, T_s = k F_s. For the benches, where the load cell drives the nut
slowly and the contact's compliance does not show.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,10},{100,-10}}, lineColor={0,0,0}, fillColor={160,160,164}, fillPattern=FillPattern.HorizontalCylinder),
      Text(extent={{-100,100},{100,60}}, textString="%name", textColor={0,0,255})}));
end RigidScrew;
