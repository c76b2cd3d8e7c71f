within THSA.Examples;
model BrushlessMotorPhases "Brushless motor whose phases may differ"
  extends THSA.Examples.BrushlessMotor(d_i=phaseEffect.d, d_u=phaseEffect.du);
  replaceable THSA.Effects.IdealPhases phaseEffect constrainedby THSA.Interfaces.PhaseEffect
    "Slot: sensors of the phase currents, legs of the inverter";
equation
  phaseEffect.i_q = i_t;
  phaseEffect.phi = phi;
  annotation(
    experiment(StartTime=0, StopTime=3, Tolerance=1e-6, Interval=1e-3),
    Documentation(info="<html><p><code>BrushlessMotor</code> with a slot for what turns with the electrical angle. Records on one held voltage
cannot tell it from torques over the angle; records at several voltages can, where speed and current are compared.</p></html>"),
    Icon(graphics={Rectangle(extent={{-80,60},{60,-60}}, lineColor={0,0,0}, fillColor={128,128,255}, fillPattern=FillPattern.HorizontalCylinder),
      Rectangle(extent={{60,10},{100,-10}}, lineColor={0,0,0}, fillColor={160,160,164}, fillPattern=FillPattern.Solid),
      Text(extent={{-100,100},{100,65}}, textString="%name", textColor={0,0,255})}));
end BrushlessMotorPhases;
