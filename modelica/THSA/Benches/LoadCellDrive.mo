within THSA.Benches;
model LoadCellDrive "Drive that imposes a velocity and measures the force it needs"
  THSA.Interfaces.TranslationalFlange flange "Driven point";
  THSA.Interfaces.RealInput v(unit="m/s") "Velocity";
  THSA.Interfaces.RealOutput F(unit="N") "Force of the drive on the driven point";
  THSA.Units.Position s(start=0, fixed=true, nominal=1e-2) "Position";
equation
  der(s) = v;
  s = flange.s;
  F = -flange.f;
  annotation(Documentation(info="<html><p>Imposes the velocity rigidly; the force is what the load cell reads.</p></html>"),
    Icon(graphics={Rectangle(extent={{-80,40},{60,-40}}, lineColor={0,127,0}, fillColor={220,240,220}, fillPattern=FillPattern.Solid),
      Text(extent={{-70,30},{50,-30}}, textString="F", textColor={0,127,0})}));
end LoadCellDrive;
