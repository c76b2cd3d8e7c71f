model StiffRC "Two RC sections, one of them a million times faster"
  parameter Real R1(unit="Ohm") = 1e-3 "Resistance of the fast section";
  parameter Real R2(unit="Ohm") = 1e3 "Resistance of the slow section";
  parameter Real C1(unit="F") = 1e-6 "Capacitance of the fast section";
  parameter Real C2(unit="F") = 1e-3 "Capacitance of the slow section";
  input Real u(unit="V") "Source";
  output Real u1(unit="V", start=0, fixed=true) "Voltage of the fast section";
  output Real u2(unit="V", start=0, fixed=true) "Voltage of the slow section";
  Real i1(unit="A") "Current into the fast section";
  Real i2(unit="A") "Current into the slow section";
equation
  R1*i1 = u - u1;
  R2*i2 = u1 - u2;
  C1*der(u1) = i1 - i2;
  C2*der(u2) = i2;
  annotation(experiment(StopTime=5, Tolerance=1e-8, Interval=0.05));
end StiffRC;
