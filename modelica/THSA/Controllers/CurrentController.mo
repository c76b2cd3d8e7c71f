within THSA.Controllers;
block CurrentController "Current loop: PI law from q-axis current error to q-axis voltage"
  extends THSA.Controllers.LimitedPI(
    reference(unit="A"), measurement(unit="A"), y(unit="V"), e(unit="A"), z(unit="A.s", nominal=0.01), y_pi(unit="V"),
    k_p(unit="V/A"), k_i(unit="V/(A.s)"), y_max(unit="V"), band(unit="V"));
  parameter Real K_pc(unit="V/A", min=0, max=1000) = 4 "Proportional gain";
  parameter Real K_ic(unit="V/(A.s)", min=0, max=1e6) = 1000 "Integral gain";
  parameter THSA.Units.Voltage U_max(min=0.001, max=10000) = 190 "Largest voltage";
  parameter THSA.Units.Voltage U_band(min=1e-9, max=100) = 0.19 "Band over which the integrator is faded out";
equation
  k_p = K_pc;
  k_i = K_ic;
  y_max = U_max;
  band = U_band;
  annotation(Documentation(info="<html><p>u_q = K_pc (i_ref &minus; i_q) + K_ic &int;(i_ref &minus; i_q) dt,
|u_q| &le; U_max, integrator held while saturated. Set by the drive, not tuned.</p></html>"));
end CurrentController;
