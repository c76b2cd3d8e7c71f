within THSA.Effects;
block PhaseCurrentOffset "Offsets of the phase currents' sensors: one period per pole pair in the reading"
  extends THSA.Interfaces.PhaseEffect;
  parameter Real o_s(unit="A") = 0 "Amplitude, sine part";
  parameter Real o_c(unit="A") = 0 "Amplitude, cosine part";
  parameter Real n(unit="1") = 1 "Periods per revolution: the pole pairs";
equation
  d = if o_s > 0 or o_s < 0 or o_c > 0 or o_c < 0 then o_s*sin(n*phi) + o_c*cos(n*phi) else 0;
  du = 0;
  annotation(Documentation(info="<html><p>Offsets o_a, o_b of two sensors make a ripple of amplitude 2/&radic;3 &radic;(o_a<sup>2</sup> + o_a o_b +
o_b<sup>2</sup>), whatever the current.</p></html>"));
end PhaseCurrentOffset;
