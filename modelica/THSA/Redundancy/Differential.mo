within THSA.Redundancy;
model Differential "Speed-summing differential: either lane drives while the other is held"
  THSA.Interfaces.RotationalFlange flange_a1 "Shaft of lane A";
  THSA.Interfaces.RotationalFlange flange_a2 "Shaft of lane B";
  THSA.Interfaces.RotationalFlange flange_b "Shaft on the gearbox's side";
equation
  flange_b.phi = flange_a1.phi + flange_a2.phi;
  flange_a1.tau + flange_b.tau = 0;
  flange_a2.tau + flange_b.tau = 0;
  annotation(
    Documentation(info="<html><p>The speeds add up, and both shafts carry the same torque: a lane that does not drive must be
held by its brake, or it is driven backwards. A jammed lane is held as well, so that the other one drives on. Its losses
are those of <code>Gearbox</code>.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={0,60,100}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-80,40},{80,-40}}, textString="A + B", textColor={0,60,100}),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end Differential;
