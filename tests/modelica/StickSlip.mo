model StickSlip "Block with breakaway friction, pulled by a spring at constant speed"
  parameter Real M(unit="kg") = 1 "Mass";
  parameter Real c(unit="N/m") = 100 "Stiffness";
  parameter Real F_C(unit="N") = 1 "Coulomb friction";
  parameter Real F_b(unit="N") = 1.5 "Breakaway friction";
  parameter Real v_S(unit="m/s") = 0.01 "Stribeck speed";
  parameter Real v_r(unit="m/s") = 1e-6 "Half width of the regularised sign";
  parameter Real v_0(unit="m/s") = 0.05 "Speed of the free end";
  output Real x(unit="m", start=0, fixed=true) "Position";
  output Real v(unit="m/s", start=0, fixed=true) "Velocity";
  Real s "Regularised sign";
  Real F(unit="N") "Friction";
equation
  der(x) = v;
  s = if v > v_r then 1 elseif v < -v_r then -1 else v/v_r;
  F = (F_C + (F_b - F_C)*exp(-(v/v_S)^2))*s;
  M*der(v) = c*(v_0*time - x) - F;
  annotation(experiment(StopTime=4, Tolerance=1e-8, Interval=0.01));
end StickSlip;
