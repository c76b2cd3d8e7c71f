within THSA.Effects;
block EmpiricalHeating "Terms in the energy lost, for what no effect with a name explains"
  extends THSA.Interfaces.HeatingEffect;
  parameter Real k_R(unit="1/J") = 0 "Coefficient of E in the resistance";
  parameter Real k_psi(unit="1/J") = 0 "Coefficient of E in the flux";
  parameter Real T_f(unit="s", min=1e-3) = 100 "Time over which E fades";
  Real E(unit="J", start=0, fixed=true, nominal=10) "Energy lost, fading; at rest where no term has it";
equation
  der(E) = if k_R > 0 or k_R < 0 or k_psi > 0 or k_psi < 0 then P - E/T_f else 0;
  g_R = k_R*E;
  g_psi = k_psi*E;
  annotation(Documentation(info="<html><p>No physics is meant by it: terms are chosen by what the recordings show, one coefficient
each.</p></html>"));
end EmpiricalHeating;
