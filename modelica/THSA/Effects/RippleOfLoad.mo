within THSA.Effects;
block RippleOfLoad "Ripple in proportion to the load over position"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real a_s(unit="1") = 0 "Amplitude, sine part";
  parameter Real a_c(unit="1") = 0 "Amplitude, cosine part";
  parameter Real n = 1 "Wave number";
equation
  F = (a_s*sin(n*z) + a_c*cos(n*z))*N;
  annotation(Documentation(info="<html><p>F = (a_s sin(n z) + a_c cos(n z)) N: a transmission ratio or an efficiency that
varies over the turn.</p></html>"));
end RippleOfLoad;
