within THSA.Effects;
block SensorDelay "Sensor with a transport delay"
  extends THSA.Interfaces.SensorEffect;
  parameter Real tau(unit="s", min=1e-6, max=1) = 1e-6 "Delay";
  Real q_1(start=0, fixed=true) "Filtered input";
  Real q_2(start=0, fixed=true) "Its change over the delay, first order";
  Real q_3(start=0, fixed=true) "Its change over the delay, second order";
  Real q_4(start=0, fixed=true) "Its change over the delay, third order";
equation
  der(q_1) = q_2/tau;
  der(q_2) = q_3/tau;
  der(q_3) = q_4/tau;
  der(q_4) = (1680*(u - q_1) - 840*q_2 - 180*q_3 - 20*q_4)/tau;
  d = -q_2 - q_4/42;
  annotation(Documentation(info="<html><p>Pad&eacute; approximation of order (4, 4), exp(&minus;p) &asymp; N(&minus;p)/N(p) with
N(p) = 1680 + 840 p + 180 p<sup>2</sup> + 20 p<sup>3</sup> + p<sup>4</sup>, p = s tau: up to p = 3i its phase errs by
less than 0.001.</p></html>"));
end SensorDelay;
