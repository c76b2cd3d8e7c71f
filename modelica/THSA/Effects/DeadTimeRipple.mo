within THSA.Effects;
block DeadTimeRipple "Dead time of three legs: six periods per pole pair in the voltage, against the current"
  extends THSA.Interfaces.PhaseEffect;
  parameter Real u_s(unit="V") = 0 "Amplitude, sine part";
  parameter Real u_c(unit="V") = 0 "Amplitude, cosine part";
  parameter Real n(unit="1") = 1 "Periods per revolution: six times the pole pairs";
  parameter Real i_r(unit="A", min=1e-6) = 0.02 "Half width of the regularised sign of the current";
equation
  d = 0;
  du = if u_s > 0 or u_s < 0 or u_c > 0 or u_c < 0
    then -(u_s*sin(n*phi) + u_c*cos(n*phi))*(if i_q > i_r then 1 elseif i_q < -i_r then -1 else i_q/i_r) else 0;
  annotation(Documentation(info="<html><p>Each leg loses a voltage against the sign of its own current; of the sum, the q axis sees a mean
(InverterDeadTime) and a ripple of the sixth order, whose size does not depend on the current.</p></html>"));
end DeadTimeRipple;
