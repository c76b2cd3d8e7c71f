model HarmonicOscillator "Mass on a spring, driven by a force"
  parameter Real m(unit="kg") = 1 "Mass";
  parameter Real c(unit="N/m") = 1 "Stiffness";
  input Real F(unit="N") "Force";
  output Real x(unit="m", start=1, fixed=true) "Position";
  Real v(unit="m/s", start=0, fixed=true) "Velocity";
equation
  der(x) = v;
  m*der(v) = F - c*x;
  annotation(experiment(StopTime=20, Tolerance=1e-8, Interval=0.1));
end HarmonicOscillator;
