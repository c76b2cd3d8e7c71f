within THSA.Controllers;
block VelocityController "Velocity loop: PI law from motor speed error to current reference"
  extends THSA.Controllers.LimitedPI(
    reference(unit="rad/s"), measurement(unit="rad/s"), y(unit="A"), e(unit="rad/s"), z(unit="rad", nominal=10), y_pi(unit="A"),
    k_p(unit="A.s/rad"), k_i(unit="A/rad"), y_max(unit="A"), band(unit="A"));
  parameter Real K_p(unit="A.s/rad", min=0, max=100) = 0.12 "Proportional gain";
  parameter Real K_i(unit="A/rad", min=0, max=1000) = 0.45 "Integral gain";
  parameter THSA.Units.Current I_max(min=0.001, max=1000) = 40 "Largest current reference";
  parameter THSA.Units.Current I_band(min=1e-9, max=10) = 0.04 "Band over which the integrator is faded out";
equation
  k_p = K_p;
  k_i = K_i;
  y_max = I_max;
  band = I_band;
  annotation(Documentation(info="<html><p>i_ref = K_p e + K_i &int;e dt with e the speed error of the motor,
|i_ref| &le; I_max, integrator held while saturated. The gains are those of table IV.</p></html>"));
end VelocityController;
