within THSA.Effects;
block EmpiricalTorque "Waves over the shaft's angle, for a torque that no effect with a name explains"
  extends THSA.Interfaces.ShaftEffect;
  parameter Real k_sin(unit="N.m") = 0 "Coefficient of sin(n phi)";
  parameter Real k_cos(unit="N.m") = 0 "Coefficient of cos(n phi)";
  parameter Real k_Tsin(unit="1") = 0 "Coefficient of T sin(n phi)";
  parameter Real k_Tcos(unit="1") = 0 "Coefficient of T cos(n phi)";
  parameter Real n(unit="1") = 1 "Periods per revolution";
equation
  tau = if k_sin > 0 or k_sin < 0 or k_cos > 0 or k_cos < 0 or k_Tsin > 0 or k_Tsin < 0 or k_Tcos > 0 or k_Tcos < 0
    then (if k_sin > 0 or k_sin < 0 or k_cos > 0 or k_cos < 0 then k_sin*sin(n*phi) + k_cos*cos(n*phi) else 0)
      + (if k_Tsin > 0 or k_Tsin < 0 or k_Tcos > 0 or k_Tcos < 0 then k_Tsin*sin(n*phi) + k_Tcos*cos(n*phi) else 0)*T else 0;
  annotation(Documentation(info="<html><p>No physics is meant by it: terms are chosen by what the recordings show, one coefficient
each.</p></html>"));
end EmpiricalTorque;
