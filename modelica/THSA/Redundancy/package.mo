within THSA;
package Redundancy "What two motor lanes and two load paths need beyond the single actuator"
  annotation(Documentation(info="<html><p>Parts of <code>RedundantActuator</code>. The article draws two motors with
motor-brake assemblies and a secondary load path, and leaves them out of its model: every value here is ours.</p>
<p>A failure is a parameter: the time from which it is there. Its default, 1e9 s, is never.</p></html>"));
end Redundancy;
