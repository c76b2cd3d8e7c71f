model VanDerPol "Van der Pol's oscillator, stiff"
  parameter Real mu = 1000 "Damping";
  output Real x0(start=2, fixed=true) "First state";
  output Real x1(start=0, fixed=true) "Second state";
equation
  der(x0) = x1;
  der(x1) = mu*(1 - x0^2)*x1 - x0;
  annotation(experiment(StopTime=2000, Tolerance=1e-7, Interval=10));
end VanDerPol;
