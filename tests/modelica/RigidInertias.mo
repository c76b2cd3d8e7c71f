model RigidInertias "Two inertias on one shaft behind a gear: a constraint between states"
  parameter Real J1(unit="kg.m2") = 2 "First inertia";
  parameter Real J2(unit="kg.m2") = 3 "Second inertia";
  parameter Real i = 5 "Gear ratio";
  input Real tau(unit="N.m") "Torque on the first inertia";
  output Real w1(unit="rad/s", start=0, fixed=true) "Speed of the first inertia";
  Real w2(unit="rad/s") "Speed of the second inertia";
  Real phi1(unit="rad", start=0, fixed=true) "Angle of the first inertia";
  Real phi2(unit="rad") "Angle of the second inertia";
  Real tau_g(unit="N.m") "Torque into the gear";
equation
  w1 = der(phi1);
  w2 = der(phi2);
  phi1 = i*phi2;
  J1*der(w1) = tau - tau_g;
  J2*der(w2) = i*tau_g;
  annotation(experiment(StopTime=1));
end RigidInertias;
