within THSA.Effects;
block Spring "Force in proportion to the position"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real c = 0 "Stiffness";
  parameter Real F_0 = 0 "Force at position zero";
equation
  F = c*z + F_0;
  annotation(Documentation(info="<html><p>c z + F_0: a return spring, a torsion bar, a cable carrier or a bellows. With c = 0 it is a
constant force, such as the weight of a vertical axis.</p></html>"));
end Spring;
