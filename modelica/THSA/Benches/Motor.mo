within THSA.Benches;
model Motor "Motor bench: motor alone in its speed loop"
  THSA.Interfaces.RealInput w_cmd(unit="rad/s") "Speed command";
  THSA.Interfaces.RealInput T_amb(unit="degC", start=25, min=-90, max=150) "Temperature of the motor";
  THSA.Interfaces.RealOutput w_m(unit="rad/s", nominal=10) "Motor speed";
  THSA.Interfaces.RealOutput i_q(unit="A") "Current of the q axis";
  THSA.Interfaces.RealOutput u_q(unit="V", nominal=10) "Voltage of the q axis";
  THSA.Controllers.VelocityController velocityController "Velocity loop";
  THSA.Controllers.CurrentController currentController "Current loop";
  THSA.Motor motor "Motor";
equation
  connect(w_cmd, velocityController.reference);
  connect(motor.w_m, velocityController.measurement);
  connect(velocityController.y, currentController.reference);
  connect(motor.i_q, currentController.measurement);
  connect(currentController.y, motor.u_q);
  connect(T_amb, motor.T);
  connect(motor.w_m, w_m);
  connect(motor.i_q, i_q);
  connect(currentController.y, u_q);
  annotation(
    experiment(StartTime=0, StopTime=10, Tolerance=1e-6, Interval=1e-3),
    Documentation(info="<html><p>Kind 1 of the experiments: speed steps; shows R_s, psi_pm, T_fm and b_m.</p></html>"));
end Motor;
