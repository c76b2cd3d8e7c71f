within THSA.Effects;
block EmpiricalTorqueConstant "Terms in the current, for what no effect with a name explains"
  extends THSA.Interfaces.TorqueConstantEffect;
  parameter Real k_a = 0 "Coefficient of |i_q| in the torque constant";
  parameter Real k_ii = 0 "Coefficient of i_q^2 in the torque constant";
  parameter Real e_a = 0 "Coefficient of |i_q| in the back-EMF";
  parameter Real e_ii = 0 "Coefficient of i_q^2 in the back-EMF";
equation
  g_t = k_a*noEvent(abs(i_q)) + k_ii*i_q^2;
  g_e = e_a*noEvent(abs(i_q)) + e_ii*i_q^2;
  annotation(Documentation(info="<html><p>No physics is meant by it: terms are chosen by what the recordings show, one coefficient
each.</p></html>"));
end EmpiricalTorqueConstant;
