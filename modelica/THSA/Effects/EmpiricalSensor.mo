within THSA.Effects;
block EmpiricalSensor "Terms in a sensor's true value, for an error that no effect with a name explains"
  extends THSA.Interfaces.SensorEffect;
  parameter Real k_1 = 0 "Coefficient of 1";
  parameter Real k_u = 0 "Coefficient of u";
  parameter Real k_uu = 0 "Coefficient of u |u|";
equation
  d = k_1 + (k_u + k_uu*noEvent(abs(u)))*u;
  annotation(Documentation(info="<html><p>No physics is meant by it: terms are chosen by what the recordings show, one coefficient
each.</p></html>"));
end EmpiricalSensor;
