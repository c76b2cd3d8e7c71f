within THSA.Controllers;
block DutyController "Proportional position law of a servo, in counts, whose output is a duty cycle of the supply"
  THSA.Interfaces.RealInput reference(unit="rad") "Reference of the position";
  THSA.Interfaces.RealInput q(unit="rad") "Measured position";
  THSA.Interfaces.RealInput U_in(unit="V") "Supply voltage";
  THSA.Interfaces.RealOutput duty(unit="1") "Duty cycle in counts";
  THSA.Interfaces.RealOutput u(unit="V") "Mean voltage at the motor";
  parameter Real k_P(unit="1", min=0, max=1e6) = 400 "Gain as it is set, in counts";
  parameter Real counts(unit="1/rad", min=1e-3, max=1e6) = 4096/6.283185307179586 "Counts of the position sensor per angle";
  parameter Real divisor(unit="1", min=1e-3, max=1e6) = 256 "Divides the gain that is set";
  parameter Real duty_max(unit="1", min=1, max=1e6) = 885 "Counts of the full supply, and limit of the duty cycle";
  Real duty_p(unit="1") "Duty cycle before the limit";
equation
  duty_p = k_P/divisor*counts*(reference - q);
  duty = if duty_p > duty_max then duty_max elseif duty_p < -duty_max then -duty_max else duty_p;
  u = duty/duty_max*U_in;
  annotation(
    Documentation(info="<html>
<p>duty = k_P/divisor &middot; counts &middot; (reference &minus; q), limited to &plusmn;duty_max; the motor sees the mean of
the chopped supply, duty/duty_max U_in. The defaults are those of a servo with 4096 counts a turn and a limit of 885
counts.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,-100},{100,100}}, lineColor={0,0,127}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-80,40},{80,-40}}, textString="P", textColor={0,0,127})}));
end DutyController;
