within THSA.Examples;
model TableIV "Ramp to 9 mm/s at 30 mm/s2 against 55 kN at -30 degC, gains tuned at 25 degC"
  THSA.Actuator actuator(velocityController(K_p=0.12, K_i=0.45)) "Actuator";
  output THSA.Units.Velocity v "Measured output velocity";
equation
  actuator.v_cmd = min(0.030*time, 0.009);
  actuator.F_load = 55e3;
  actuator.T_amb = -30;
  actuator.T_motor = -300;
  actuator.T_gearbox = -300;
  actuator.T_screw = -300;
  v = actuator.v;
  annotation(
    experiment(StartTime=0, StopTime=1.2, Tolerance=1e-6, Interval=1e-3),
    Documentation(info="<html><p>The experiment of table IV of the article, first row: rise time 0.43 s, steady-state
error 0.002.</p></html>"));
end TableIV;
