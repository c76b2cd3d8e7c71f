model Pendulum "Pendulum with viscous friction and a torque"
  parameter Real L(unit="m") = 1 "Length";
  parameter Real d(unit="1/s") = 0.1 "Damping per inertia";
  constant Real g = 9.80665 "Gravity";
  output Real phi(unit="rad", start=2, fixed=true) "Angle";
  Real w(unit="rad/s", start=0, fixed=true) "Speed";
  Real E "Energy per mass";
equation
  der(phi) = w;
  der(w) = -g/L*sin(phi) - d*w;
  E = (L*w)^2/2 + g*L*(1 - cos(phi));
  annotation(experiment(StopTime=10, Tolerance=1e-8, Interval=0.01));
end Pendulum;
