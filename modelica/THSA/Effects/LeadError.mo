within THSA.Effects;
block LeadError "Periodic error of the screw's lead"
  extends THSA.Interfaces.ContactEffect;
  parameter Real a_s(unit="m") = 0 "Amplitude, sine part";
  parameter Real a_c(unit="m") = 0 "Amplitude, cosine part";
  parameter Real n(unit="1") = 1 "Periods per revolution";
equation
  e = if a_s > 0 or a_s < 0 or a_c > 0 or a_c < 0 then a_s*sin(n*phi) + a_c*(cos(n*phi) - 1) else 0;
  k_e = if a_s > 0 or a_s < 0 or a_c > 0 or a_c < 0 then n*(a_s*cos(n*phi) - a_c*sin(n*phi)) else 0;
  v_e = k_e*w;
  annotation(Documentation(info="<html><p>Deviation of the travel from lead times angle, zero at the start.</p></html>"));
end LeadError;
