within THSA.Effects;
block TorqueRipple "Torque of the screw that varies over its turn"
  extends THSA.Interfaces.ShaftEffect;
  parameter Real a_s(unit="N.m") = 0 "Amplitude, sine part";
  parameter Real a_c(unit="N.m") = 0 "Amplitude, cosine part";
  parameter Real c_s(unit="1") = 0 "Amplitude as a share of the contact's torque, sine part";
  parameter Real c_c(unit="1") = 0 "Amplitude as a share of the contact's torque, cosine part";
  parameter Real n(unit="1") = 1 "Periods per revolution";
equation
  tau = (a_s + c_s*T)*sin(n*phi) + (a_c + c_c*T)*cos(n*phi);
  annotation(Documentation(info="<html><p>Part of the torque at the screw, hence of what decides whether the load aids: the no-back
device drags by it. Shares of the load: an efficiency that varies over the turn.</p></html>"));
end TorqueRipple;
