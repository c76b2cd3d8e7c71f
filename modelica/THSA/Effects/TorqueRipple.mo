within THSA.Effects;
block TorqueRipple "Torque of the screw that varies over its turn"
  extends THSA.Interfaces.ShaftEffect;
  parameter Real a_s(unit="N.m") = 0 "Amplitude, sine part";
  parameter Real a_c(unit="N.m") = 0 "Amplitude, cosine part";
  parameter Real c_s(unit="1") = 0 "Amplitude as a share of the contact's torque, sine part";
  parameter Real c_c(unit="1") = 0 "Amplitude as a share of the contact's torque, cosine part";
  parameter Real n(unit="1") = 1 "Periods per revolution";
equation
  tau = if a_s > 0 or a_s < 0 or a_c > 0 or a_c < 0 or c_s > 0 or c_s < 0 or c_c > 0 or c_c < 0
    then (if a_s > 0 or a_s < 0 or a_c > 0 or a_c < 0 then a_s*sin(n*phi) + a_c*cos(n*phi) else 0)
      + (if c_s > 0 or c_s < 0 or c_c > 0 or c_c < 0 then c_s*sin(n*phi) + c_c*cos(n*phi) else 0)*T else 0;
  annotation(Documentation(info="<html><p>Part of the torque at the screw, hence of what decides whether the load aids: the no-back
device drags by it. Shares of the load: an efficiency that varies over the turn.</p></html>"));
end TorqueRipple;
