within THSA.Effects;
block RippleFriction "Friction that varies with the angle of the shaft"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real a_s = 0 "Amplitude, sine part";
  parameter Real a_c = 0 "Amplitude, cosine part";
  parameter Real n(unit="1") = 1 "Periods per revolution";
equation
  F = if a_s > 0 or a_s < 0 or a_c > 0 or a_c < 0 then (a_s*sin(n*z) + a_c*cos(n*z))*s else 0;
  annotation(Documentation(info="<html><p>Friction of the screw with n periods a revolution; in contrast to <code>Ripple</code> it opposes the motion.</p></html>"));
end RippleFriction;
