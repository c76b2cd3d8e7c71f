within THSA.Effects;
block InverterDeadTime "Voltage that the dead time of the inverter takes, against the current"
  extends THSA.Interfaces.VoltageEffect;
  parameter Real U_d(unit="V") = 0 "Voltage";
  parameter Real i_r(unit="A", min=1e-6) = 0.05 "Half width of the regularised sign of the current";
equation
  du = if U_d > 0 or U_d < 0 then -U_d*(if i_q > i_r then 1 elseif i_q < -i_r then -1 else i_q/i_r) else 0;
  annotation(Documentation(info="<html><p>&minus;U_d sgn(i_q).</p></html>"));
end InverterDeadTime;
