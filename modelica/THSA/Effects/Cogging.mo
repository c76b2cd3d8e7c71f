within THSA.Effects;
block Cogging "Torque that the teeth of the stator draw from the magnets, without current"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real a_s = 0 "Amplitude, sine part";
  parameter Real a_c = 0 "Amplitude, cosine part";
  parameter Real a_s2 = 0 "Amplitude of the second harmonic, sine part";
  parameter Real a_c2 = 0 "Amplitude of the second harmonic, cosine part";
  parameter Real n(unit="1") = 1 "Periods per revolution";
equation
  F = (if a_s > 0 or a_s < 0 or a_c > 0 or a_c < 0 then a_s*sin(n*z) + a_c*cos(n*z) else 0)
    + (if a_s2 > 0 or a_s2 < 0 or a_c2 > 0 or a_c2 < 0 then a_s2*sin(2*n*z) + a_c2*cos(2*n*z) else 0);
  annotation(Documentation(info="<html><p>A torque over the rotor angle with n periods a revolution and its second harmonic; it does
no work over a period.</p></html>"));
end Cogging;
