within THSA.Effects;
block EmpiricalVoltage "Terms in the current and the rotor's angle, for a voltage that no effect with a name explains"
  extends THSA.Interfaces.VoltageEffect;
  parameter Real k_1(unit="V") = 0 "Coefficient of 1";
  parameter Real k_s(unit="V") = 0 "Coefficient of tanh(i_q/i_s)";
  parameter Real i_s(unit="A", min=1e-6) = 1 "Current over which that turns";
  parameter Real k_sin(unit="V") = 0 "Coefficient of tanh(i_q/i_s) sin(n phi)";
  parameter Real k_cos(unit="V") = 0 "Coefficient of tanh(i_q/i_s) cos(n phi)";
  parameter Real n(unit="1") = 1 "Periods of that wave per revolution";
  parameter Real k_ii = 0 "Coefficient of i_q |i_q|";
equation
  du = k_1 + k_ii*i_q*noEvent(abs(i_q)) + (if k_s > 0 or k_s < 0 then k_s*tanh(i_q/i_s) else 0)
    + (if k_sin > 0 or k_sin < 0 or k_cos > 0 or k_cos < 0 then (k_sin*sin(n*phi) + k_cos*cos(n*phi))*tanh(i_q/i_s) else 0);
  annotation(Documentation(info="<html><p>No physics is meant by it: terms are chosen by what the recordings show, one coefficient
each.</p></html>"));
end EmpiricalVoltage;
