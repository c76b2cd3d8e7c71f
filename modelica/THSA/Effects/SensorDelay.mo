within THSA.Effects;
block SensorDelay "Sensor with a transport delay"
  extends THSA.Interfaces.SensorEffect;
  parameter Real tau(unit="s", min=1e-6, max=1) = 1e-6 "Delay";
  Real q_1(start=0, fixed=true) "First state of the first half";
  Real p_1(start=0, fixed=true) "Second state of the first half";
  Real q_2(start=0, fixed=true) "First state of the second half";
  Real p_2(start=0, fixed=true) "Second state of the second half";
equation
  der(q_1) = 2*p_1/tau;
  der(p_1) = 2*(12*(u - q_1) - 6*p_1)/tau;
  der(q_2) = 2*p_2/tau;
  der(p_2) = 2*(12*(u - p_1 - q_2) - 6*p_2)/tau;
  d = -p_1 - p_2;
  annotation(Documentation(info="<html><p>The delay in two halves, each a Pad&eacute; approximation of order (2, 2):
exp(&minus;s T) &asymp; (1 &minus; sT/2 + s<sup>2</sup>T<sup>2</sup>/12)/(1 + sT/2 + s<sup>2</sup>T<sup>2</sup>/12), T = tau/2.</p></html>"));
end SensorDelay;
