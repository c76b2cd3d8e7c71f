within THSA.Effects;
block FroelichSaturation "Torque constant that falls with the current as a fraction of it"
  extends THSA.Interfaces.TorqueConstantEffect;
  parameter Real a(unit="1/A2", min=0) = 0 "Relative fall per square of the current, of small currents";
  parameter Real b(unit="1/A", min=0) = 0 "Relative fall per current, of small currents";
  parameter Real r_e(unit="1", min=0, max=1) = 0 "Share of the fall in the back-EMF";
equation
  g_t = 1/(1 + a*i_q^2 + b*noEvent(abs(i_q))) - 1;
  g_e = r_e*g_t;
  annotation(Documentation(info="<html><p>K_t/(1 + a i_q<sup>2</sup> + b |i_q|): a saturation that levels off; the torque
never changes its sign, however large the current.</p></html>"));
end FroelichSaturation;
