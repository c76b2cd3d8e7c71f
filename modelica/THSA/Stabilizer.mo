within THSA;
model Stabilizer "Moving mass of nut and stabilizer against the aerodynamic force"
  THSA.Interfaces.TranslationalFlange flange "Nut";
  THSA.Interfaces.RealInput F_load(unit="N") "Aerodynamic force, positive opposes positive velocity";
  parameter THSA.Units.Mass M(min=0.001, max=1e6) = 200 "Moving mass reduced to the nut";
  THSA.Units.Position x(start=0, fixed=false, nominal=1e-2) "Position";
  THSA.Units.Velocity v(start=0, fixed=true, nominal=1e-2) "Velocity";
equation
  x = flange.s;
  v = der(x);
  M*der(v) = flange.f - F_load;
  annotation(
    Documentation(info="<html><p>M dv/dt = F_s &minus; friction of the nut &minus; F_load. The start position is left
to the system, which may ask for equilibrium.</p></html>"),
    Icon(graphics={Polygon(points={{-80,20},{80,60},{80,-60},{-80,-20}}, lineColor={0,0,0}, fillColor={220,230,240}, fillPattern=FillPattern.Solid),
      Text(extent={{-100,100},{100,65}}, textString="%name", textColor={0,0,255})}));
end Stabilizer;
