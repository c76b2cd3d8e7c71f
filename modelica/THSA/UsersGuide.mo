within THSA;
package UsersGuide "User's guide"
  annotation(DocumentationClass=true, Documentation(info="<html>
<h4>What the package holds</h4>
<ul>
<li><code>Actuator</code>: the whole actuator in closed loop; inputs <code>v_cmd</code>, <code>F_load</code>,
<code>T_amb</code>; outputs <code>v</code>, <code>x</code>, <code>w_m</code>, <code>i_q</code>, <code>u_q</code>.</li>
<li><code>ThermalActuator</code>: the same with a thermal network; the temperatures of its parts in
<code>Thermal</code>.</li>
<li><code>RedundantActuator</code>: two motor lanes, active and standby, and two load paths; its failures are
parameters.</li>
<li><code>Benches</code>: motor, gearbox and screw alone, as they are tested in the low-temperature chamber.</li>
<li>One class a component: <code>Motor</code>, <code>Gearbox</code>, <code>NoBack</code>, <code>Screw</code>,
<code>Nut</code>, <code>Stabilizer</code>, <code>VelocitySensor</code> and the <code>Controllers</code>.</li>
<li><code>Examples.EMPS</code>: another drive, of which public measurements exist.</li>
</ul>
<h4>Laws over temperature</h4>
<p>A quantity that drifts with temperature is a <code>TemperatureLaw</code>: a cubic polynomial plus two
exponentials, all coefficients parameters. To work at one temperature set every coefficient but
<code>a0</code> to zero.</p>
<h4>Temperatures of parts</h4>
<p>An input temperature below absolute zero, the start value of <code>T_motor</code>, <code>T_gearbox</code> and
<code>T_screw</code>, says that nothing is connected: the part is then at <code>T_amb</code>. In a model that contains an
<code>Actuator</code>, set them to &minus;300.</p>
<h4>Friction</h4>
<p>The sign of the sliding speed is a straight line through zero, <code>v_r</code> wide on each side. The width is
a parameter: a held load creeps at most at <code>v_r</code>. Crossing the border is a state event. The actuator's widths
(1e-8 m/s at the nut, 1e-5 rad/s at the gear, 3e-4 rad/s at the motor) are chosen so that a minute's recording cannot tell them
from true stick: at ten times these, breakaway moves fitted inertia, stiffness and friction by about a standard error.</p>
<h4>Connecting to the Modelica Standard Library</h4>
<p><code>Interfaces.RotationalFlange</code> and <code>Interfaces.TranslationalFlange</code> have the variables of
<code>Modelica.Mechanics.Rotational.Interfaces.Flange_a</code> and
<code>Modelica.Mechanics.Translational.Interfaces.Flange_a</code>.</p>
</html>"));
end UsersGuide;
