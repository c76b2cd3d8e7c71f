within ;
package THSA "Electrical trimmable horizontal stabilizer actuator over temperature"
  annotation(
    version="0.1.0",
    Documentation(info="<html>
<p>Multiphysics model of an electrical trimmable horizontal stabilizer actuator (THSA): permanent-magnet
synchronous motor, gearbox, no-back device, roller screw, nut and stabilizer, velocity and current controllers,
with laws over temperature for the parameters of all losses. Self-contained; the flanges have the structure of those of the Modelica
Standard Library (a potential angle or position, a flow torque or force), so that its components connect.</p>
<p>Source of the physics: Ma, Fu, Xia, <em>Optimization Method for the Control Law of an Electrical Trimmable
Horizontal Stabilizer Actuator Operating at Low Temperatures</em>.</p>
</html>"),
    Icon(coordinateSystem(extent={{-100,-100},{100,100}}), graphics={
      Rectangle(extent={{-100,-100},{100,100}}, radius=20, lineColor={0,60,100}, fillColor={235,242,248}, fillPattern=FillPattern.Solid),
      Text(extent={{-90,40},{90,-40}}, textString="THSA", textColor={0,60,100})}));
end THSA;
