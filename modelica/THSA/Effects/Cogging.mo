within THSA.Effects;
block Cogging "Torque that the teeth of the stator draw from the magnets, without current"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real a_s = 0 "Amplitude, sine part";
  parameter Real a_c = 0 "Amplitude, cosine part";
  parameter Real a_s2 = 0 "Amplitude of the second harmonic, sine part";
  parameter Real a_c2 = 0 "Amplitude of the second harmonic, cosine part";
  parameter Real n(unit="1") = 1 "Periods per revolution";
  parameter Real a_s3 = 0 "Amplitude of a second order, sine part";
  parameter Real a_c3 = 0 "Amplitude of a second order, cosine part";
  parameter Real n_3(unit="1") = 1 "Periods per revolution of the second order";
  parameter Real a_s4 = 0 "Amplitude of a third order, sine part";
  parameter Real a_c4 = 0 "Amplitude of a third order, cosine part";
  parameter Real n_4(unit="1") = 1 "Periods per revolution of the third order";
  parameter Real a_s5 = 0 "Amplitude of a fourth order, sine part";
  parameter Real a_c5 = 0 "Amplitude of a fourth order, cosine part";
  parameter Real n_5(unit="1") = 1 "Periods per revolution of the fourth order";
equation
  F = (if a_s > 0 or a_s < 0 or a_c > 0 or a_c < 0 then a_s*sin(n*z) + a_c*cos(n*z) else 0)
    + (if a_s2 > 0 or a_s2 < 0 or a_c2 > 0 or a_c2 < 0 then a_s2*sin(2*n*z) + a_c2*cos(2*n*z) else 0)
    + (if a_s3 > 0 or a_s3 < 0 or a_c3 > 0 or a_c3 < 0 then a_s3*sin(n_3*z) + a_c3*cos(n_3*z) else 0)
    + (if a_s4 > 0 or a_s4 < 0 or a_c4 > 0 or a_c4 < 0 then a_s4*sin(n_4*z) + a_c4*cos(n_4*z) else 0)
    + (if a_s5 > 0 or a_s5 < 0 or a_c5 > 0 or a_c5 < 0 then a_s5*sin(n_5*z) + a_c5*cos(n_5*z) else 0);
  annotation(Documentation(info="<html><p>A torque over the rotor angle with n periods a revolution, its second harmonic, and up to three
further orders (slots, poles, and their common multiples); it does no work over a period.</p></html>"));
end Cogging;
