within THSA;
model VelocitySensor "Velocity sensor with first-order filter"
  THSA.Interfaces.TranslationalFlange flange "Measured point";
  THSA.Interfaces.RealOutput y(unit="m/s", start=0, fixed=true, nominal=1e-2) "Measured velocity";
  parameter THSA.Units.Time tau_v(min=1e-6, max=10) = 0.010 "Time constant";
equation
  tau_v*der(y) = der(flange.s) - y;
  flange.f = 0;
  annotation(
    Documentation(info="<html><p>&tau;_v dy/dt + y = v.</p></html>"),
    Icon(graphics={Ellipse(extent={{-60,60},{60,-60}}, lineColor={0,0,0}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-50,30},{50,-30}}, textString="v", textColor={0,0,0}),
      Text(extent={{-100,100},{100,65}}, textString="%name", textColor={0,0,255})}));
end VelocitySensor;
