within THSA.Effects;
block WindingSelfHeating "Winding that its copper loss warms"
  extends THSA.Interfaces.HeatingEffect;
  parameter Real h(unit="K/J", min=0, max=10) = 0 "Warming per energy, 1/C";
  parameter Real tau(unit="s", min=1e-3, max=1e6) = 100 "Time constant of cooling, R C";
  Real theta(unit="K", start=0, fixed=true, nominal=1) "Temperature of the winding above that of the box";
equation
  der(theta) = h*P - theta/tau;
  dT = theta;
  annotation(Documentation(info="<html><p>One thermal mass: C d&theta;/dt = P_co &minus; &theta;/R.</p></html>"));
end WindingSelfHeating;
