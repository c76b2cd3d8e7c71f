model Dahlquist "Dahlquist's test equation"
  parameter Real k(unit="1/s") = 1 "Rate";
  output Real x(start=1, fixed=true) "State";
equation
  der(x) = -k*x;
  annotation(experiment(StopTime=10, Tolerance=1e-6, Interval=0.1));
end Dahlquist;
