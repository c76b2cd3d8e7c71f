within THSA.Redundancy;
block MotorBrake "Power-off brake at the shaft of a motor"
  THSA.Interfaces.BooleanInput release "The coil is powered: the brake is to be open";
  THSA.Interfaces.RealInput s(unit="1") "Regularised sign of the shaft's speed";
  THSA.Interfaces.RealOutput tau(unit="N.m") "Torque, positive opposes positive speed";
  parameter THSA.Units.Torque T_b(min=0, max=1e4) = 25 "Torque of the closed brake, above the motor's largest";
  parameter THSA.Units.Time t_d(min=1e-4, max=10) = 0.02 "Time that coil and plate take to close or open";
  parameter THSA.Units.Time t_stuck(min=-1, max=1e9) = 1e9 "Failure: time from which the brake does not release";
  parameter THSA.Units.Time t_slip(min=-1, max=1e9) = 1e9 "Failure: time from which the brake does not hold";
  parameter THSA.Units.Ratio r_slip(min=0, max=1) = 0 "Share of the torque that a brake that does not hold still has";
  Boolean closing "The plate is to be closed";
  Boolean closed "The plate is closed";
  discrete Real t_0(unit="s", start=-1e9, fixed=true) "Time of the last command";
equation
  closing = not release or time >= t_stuck;
  when change(closing) then
    t_0 = time;
  end when;
  closed = if time < t_0 + t_d then not closing else closing;
  tau = if closed then T_b*s*(if time >= t_slip then r_slip else 1) else 0;
  annotation(
    Documentation(info="<html><p>Coulomb friction at the motor's shaft, with the sign of its bearings: a closed brake
under a torque below T_b creeps within the width of that sign. It closes when the power is taken off, t_d later. It starts as
it is commanded.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={0,60,100}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-80,40},{80,-40}}, textString="brake", textColor={0,60,100}),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end MotorBrake;
