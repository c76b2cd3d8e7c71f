within THSA.Effects;
block EmpiricalDelay "A delay, for a sensor's error that no effect with a name explains"
  extends THSA.Effects.SensorDelay;
  annotation(Documentation(info="<html><p>No physics is meant by it: terms are chosen by what the recordings show, one coefficient
each.</p></html>"));
end EmpiricalDelay;
