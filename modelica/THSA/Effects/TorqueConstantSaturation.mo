within THSA.Effects;
block TorqueConstantSaturation "Torque constant that falls with the current"
  extends THSA.Interfaces.TorqueConstantEffect;
  parameter Real a(unit="1/A2") = 0 "Relative fall per square of the current";
  parameter Real b(unit="1/A") = 0 "Relative fall per current";
  parameter Real r_e(unit="1", min=0, max=1) = 0 "Share of the fall in the back-EMF";
equation
  g_t = -a*i_q^2 - b*noEvent(abs(i_q));
  g_e = r_e*g_t;
  annotation(Documentation(info="<html><p>K_t (1 &minus; a i_q<sup>2</sup> &minus; b |i_q|).</p></html>"));
end TorqueConstantSaturation;
