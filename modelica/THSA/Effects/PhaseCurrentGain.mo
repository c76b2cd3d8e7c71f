within THSA.Effects;
block PhaseCurrentGain "Unequal gains of the phase currents' sensors: two periods per pole pair, in proportion to the current"
  extends THSA.Interfaces.PhaseEffect;
  parameter Real g_s(unit="1") = 0 "Relative error, sine part";
  parameter Real g_c(unit="1") = 0 "Relative error, cosine part";
  parameter Real n(unit="1") = 1 "Periods per revolution: twice the pole pairs";
equation
  d = if g_s > 0 or g_s < 0 or g_c > 0 or g_c < 0 then (g_s*sin(n*phi) + g_c*cos(n*phi))*i_q else 0;
  du = 0;
  annotation(Documentation(info="<html><p>Two sensors whose gains differ by the share &Delta; make a ripple of &Delta;/&radic;3 of the current. The part that
does not turn is a gain error (SensorGain).</p></html>"));
end PhaseCurrentGain;
