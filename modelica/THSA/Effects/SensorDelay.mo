within THSA.Effects;
block SensorDelay "Sensor with a transport delay"
  extends THSA.Interfaces.SensorEffect;
  parameter Real tau(unit="s", min=1e-6, max=1) = 1e-6 "Delay";
  constant Real tau_0(unit="s") = 1e-5 "Up to this delay the sensor is ideal, and all is at rest";
  Real q_1(start=0, fixed=true, nominal=0.01) "Input of the first half of the delay, filtered";
  Real q_2(start=0, fixed=true, nominal=0.03) "Its change over that half, first order";
  Real q_3(start=0, fixed=true, nominal=0.13) "Its change over that half, second order";
  Real q_4(start=0, fixed=true, nominal=1.3) "Its change over that half, third order";
  Real q_5(start=0, fixed=true, nominal=14) "Its change over that half, fourth order";
  Real q_6(start=0, fixed=true, nominal=1.8e+02) "Its change over that half, fifth order";
  Real q_7(start=0, fixed=true, nominal=2.7e+03) "Its change over that half, sixth order";
  Real q_8(start=0, fixed=true, nominal=5.6e+04) "Its change over that half, seventh order";
  Real r_1(start=0, fixed=true, nominal=0.01) "Input of the second half of the delay, filtered";
  Real r_2(start=0, fixed=true, nominal=0.03) "Its change over that half, first order";
  Real r_3(start=0, fixed=true, nominal=0.13) "Its change over that half, second order";
  Real r_4(start=0, fixed=true, nominal=1.3) "Its change over that half, third order";
  Real r_5(start=0, fixed=true, nominal=14) "Its change over that half, fourth order";
  Real r_6(start=0, fixed=true, nominal=1.8e+02) "Its change over that half, fifth order";
  Real r_7(start=0, fixed=true, nominal=2.7e+03) "Its change over that half, sixth order";
  Real r_8(start=0, fixed=true, nominal=5.6e+04) "Its change over that half, seventh order";
  Real m "Input of the second half";
equation
  der(q_1) = if tau > tau_0 then 2*q_2/tau else 0;
  der(q_2) = if tau > tau_0 then 2*q_3/tau else 0;
  der(q_3) = if tau > tau_0 then 2*q_4/tau else 0;
  der(q_4) = if tau > tau_0 then 2*q_5/tau else 0;
  der(q_5) = if tau > tau_0 then 2*q_6/tau else 0;
  der(q_6) = if tau > tau_0 then 2*q_7/tau else 0;
  der(q_7) = if tau > tau_0 then 2*q_8/tau else 0;
  der(q_8) = if tau > tau_0 then 2*(518918400*(u - q_1) - 259459200*q_2 - 60540480*q_3 - 8648640*q_4 - 831600*q_5
    - 55440*q_6 - 2520*q_7 - 72*q_8)/tau else 0;
  m = if tau > tau_0 then u - q_2 - q_4/30 - q_6/4680 - q_8/3603600 else u;
  der(r_1) = if tau > tau_0 then 2*r_2/tau else 0;
  der(r_2) = if tau > tau_0 then 2*r_3/tau else 0;
  der(r_3) = if tau > tau_0 then 2*r_4/tau else 0;
  der(r_4) = if tau > tau_0 then 2*r_5/tau else 0;
  der(r_5) = if tau > tau_0 then 2*r_6/tau else 0;
  der(r_6) = if tau > tau_0 then 2*r_7/tau else 0;
  der(r_7) = if tau > tau_0 then 2*r_8/tau else 0;
  der(r_8) = if tau > tau_0 then 2*(518918400*(m - r_1) - 259459200*r_2 - 60540480*r_3 - 8648640*r_4 - 831600*r_5
    - 55440*r_6 - 2520*r_7 - 72*r_8)/tau else 0;
  d = if tau > tau_0 then m - u - r_2 - r_4/30 - r_6/4680 - r_8/3603600 else 0;
  annotation(Documentation(info="<html><p>Two Pad&eacute; approximations of order (8, 8) in series, of half the delay each:
exp(&minus;p) &asymp; N(&minus;p)/N(p) with N(p) = 518918400 + 259459200 p + 60540480 p<sup>2</sup> + 8648640 p<sup>3</sup>
+ 831600 p<sup>4</sup> + 55440 p<sup>5</sup> + 2520 p<sup>6</sup> + 72 p<sup>7</sup> + p<sup>8</sup>, p = s tau/2: up to
s tau = 16i the phase errs by less than 0.002. One alone moves the delay that is found in a recording with breakaways by
more than its standard error. Up to tau_0 the sensor is ideal.</p></html>"));
end SensorDelay;
