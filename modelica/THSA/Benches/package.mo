within THSA;
package Benches "Component benches of the low-temperature chamber"
  annotation(Documentation(info="<html><p>What is measured on each bench: the motor alone in its speed loop; nut, screw
and gearbox driven by a load cell; nut and screw driven by a load cell.</p></html>"));
end Benches;
