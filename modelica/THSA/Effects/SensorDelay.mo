within THSA.Effects;
block SensorDelay "Sensor with a transport delay"
  extends THSA.Interfaces.SensorEffect;
  parameter Real tau(unit="s", min=1e-6, max=1) = 1e-6 "Delay";
  constant Real tau_0(unit="s") = 1e-5 "Up to this delay the sensor is ideal, and all is at rest";
  Real q_1(start=0, fixed=true) "Filtered input";
  Real q_2(start=0, fixed=true) "Its change over the delay, first order";
  Real q_3(start=0, fixed=true) "Its change over the delay, second order";
  Real q_4(start=0, fixed=true) "Its change over the delay, third order";
  Real q_5(start=0, fixed=true) "Its change over the delay, fourth order";
  Real q_6(start=0, fixed=true) "Its change over the delay, fifth order";
  Real q_7(start=0, fixed=true) "Its change over the delay, sixth order";
  Real q_8(start=0, fixed=true) "Its change over the delay, seventh order";
equation
  der(q_1) = if tau > tau_0 then q_2/tau else 0;
  der(q_2) = if tau > tau_0 then q_3/tau else 0;
  der(q_3) = if tau > tau_0 then q_4/tau else 0;
  der(q_4) = if tau > tau_0 then q_5/tau else 0;
  der(q_5) = if tau > tau_0 then q_6/tau else 0;
  der(q_6) = if tau > tau_0 then q_7/tau else 0;
  der(q_7) = if tau > tau_0 then q_8/tau else 0;
  der(q_8) = if tau > tau_0 then (518918400*(u - q_1) - 259459200*q_2 - 60540480*q_3 - 8648640*q_4 - 831600*q_5 - 55440*q_6
    - 2520*q_7 - 72*q_8)/tau else 0;
  d = if tau > tau_0 then -q_2 - q_4/30 - q_6/4680 - q_8/3603600 else 0;
  annotation(Documentation(info="<html><p>Pad&eacute; approximation of order (8, 8), exp(&minus;p) &asymp; N(&minus;p)/N(p) with
N(p) = 518918400 + 259459200 p + 60540480 p<sup>2</sup> + 8648640 p<sup>3</sup> + 831600 p<sup>4</sup> + 55440 p<sup>5</sup>
+ 2520 p<sup>6</sup> + 72 p<sup>7</sup> + p<sup>8</sup>, p = s tau: up to p = 8i its phase errs by less than 0.001.
Up to tau_0 the sensor is ideal.</p></html>"));
end SensorDelay;
