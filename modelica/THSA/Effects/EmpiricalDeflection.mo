within THSA.Effects;
block EmpiricalDeflection "Waves over the screw's angle, for a deflection that no effect with a name explains"
  extends THSA.Interfaces.ContactEffect;
  parameter Real k_sin(unit="m") = 0 "Coefficient of sin(n phi)";
  parameter Real k_cos(unit="m") = 0 "Coefficient of cos(n phi) - 1";
  parameter Real n(unit="1") = 1 "Periods per revolution";
equation
  e = if k_sin > 0 or k_sin < 0 or k_cos > 0 or k_cos < 0 then k_sin*sin(n*phi) + k_cos*(cos(n*phi) - 1) else 0;
  k_e = if k_sin > 0 or k_sin < 0 or k_cos > 0 or k_cos < 0 then n*(k_sin*cos(n*phi) - k_cos*sin(n*phi)) else 0;
  v_e = k_e*w;
  annotation(Documentation(info="<html><p>No physics is meant by it: terms are chosen by what the recordings show, one coefficient
each.</p></html>"));
end EmpiricalDeflection;
