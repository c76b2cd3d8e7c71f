within THSA;
model ThermalActuator "THSA whose losses warm its parts"
  extends THSA.Actuator(redeclare THSA.Thermal.Network temperatures);
  annotation(
    experiment(StartTime=0, StopTime=600, Tolerance=1e-6, Interval=1e-2),
    Documentation(info="<html><p><code>Actuator</code> with a thermal network. It starts soaked at <code>T_amb</code>. A part
whose temperature is connected has that temperature; the network computes the others.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,-100},{100,100}}, lineColor={191,0,0}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-90,40},{90,-40}}, textString="THSA+T", textColor={191,0,0}),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end ThermalActuator;
