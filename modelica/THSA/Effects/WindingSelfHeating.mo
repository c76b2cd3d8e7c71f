within THSA.Effects;
block WindingSelfHeating "Winding and magnets that the copper loss warms"
  extends THSA.Interfaces.HeatingEffect;
  parameter Real h(unit="K/J", min=0, max=100) = 0 "Warming per energy, 1/C";
  parameter Real tau(unit="s", min=1e-3, max=1e6) = 100 "Time constant of cooling, R C";
  parameter Real alpha_R(unit="1/K", min=0, max=0.1) = 3.93e-3 "Temperature coefficient of the resistance, copper";
  parameter Real alpha_psi(unit="1/K", min=-0.1, max=0.1) = -1.2e-3 "Temperature coefficient of the flux, NdFeB";
  Real E(unit="J", start=0, fixed=true, nominal=10) "Heat that has not been given off";
  Real theta(unit="K") "Temperature above that of the box";
equation
  der(E) = if h > 0 then P - E/tau else 0;
  theta = h*E;
  g_R = alpha_R*theta;
  g_psi = alpha_psi*theta;
  annotation(Documentation(info="<html><p>One thermal mass: C d&theta;/dt = P_co &minus; &theta;/R_th; resistance and flux change
linearly with &theta;.</p></html>"));
end WindingSelfHeating;
