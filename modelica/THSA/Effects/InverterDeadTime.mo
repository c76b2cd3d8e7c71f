within THSA.Effects;
block InverterDeadTime "Voltage that the dead time of the inverter takes, against the current"
  extends THSA.Interfaces.VoltageEffect;
  parameter Real U_d(unit="V") = 0 "Voltage";
  parameter Real i_r(unit="A", min=1e-6) = 0.05 "Half width of the regularised sign of the current";
  parameter Real u_s(unit="V") = 0 "Amplitude of its ripple, sine part";
  parameter Real u_c(unit="V") = 0 "Amplitude of its ripple, cosine part";
  parameter Real n(unit="1") = 1 "Periods of the ripple per revolution: six times the pole pairs";
equation
  du = if U_d > 0 or U_d < 0 then -(U_d + (if u_s > 0 or u_s < 0 or u_c > 0 or u_c < 0 then u_s*sin(n*phi) + u_c*cos(n*phi) else 0))
    *(if i_q > i_r then 1 elseif i_q < -i_r then -1 else i_q/i_r) else 0;
  annotation(Documentation(info="<html><p>&minus;(U_d + u_s sin(n &phi;) + u_c cos(n &phi;)) sgn(i_q). Each leg loses a voltage against the sign of its
own current; of the sum, the q axis sees a mean and a ripple of six periods per pole pair.</p></html>"));
end InverterDeadTime;
