within THSA.Redundancy;
block Monitor "Chooses the lane that drives, from what the sensors say"
  THSA.Interfaces.RealInput w_ref(unit="rad/s") "Commanded speed of the driving motor";
  THSA.Interfaces.RealInput w_A(unit="rad/s") "Speed of motor A, as measured";
  THSA.Interfaces.RealInput w_B(unit="rad/s") "Speed of motor B, as measured";
  THSA.Interfaces.RealInput w_v(unit="rad/s") "Speed of the output, as measured, seen at the motors";
  THSA.Interfaces.RealInput F_2(unit="N") "Force on the secondary load path";
  THSA.Interfaces.BooleanOutput enable_A "Lane A drives, or holds";
  THSA.Interfaces.BooleanOutput enable_B "Lane B drives, or holds";
  THSA.Interfaces.BooleanOutput release_A "The brake of lane A is to be open";
  THSA.Interfaces.BooleanOutput release_B "The brake of lane B is to be open";
  THSA.Interfaces.RealOutput ref_A(unit="rad/s") "Reference of lane A";
  THSA.Interfaces.RealOutput ref_B(unit="rad/s") "Reference of lane B";
  parameter THSA.Units.AngularVelocity w_err(min=1e-3, max=1e4) = 30 "Speed error of a lane that has failed";
  parameter THSA.Units.AngularVelocity w_slip(min=1e-3, max=1e4) = 5 "Speed of a held lane whose brake has failed";
  parameter THSA.Units.AngularVelocity w_dis(min=1e-3, max=1e4) = 30 "Disagreement of output and motors that condemns the output's sensor";
  parameter THSA.Units.Force F_lock(min=1, max=1e7) = 2000 "Force on the secondary path that says the primary one is broken";
  parameter THSA.Units.Time t_c(min=1e-4, max=100) = 0.1 "Confirmation time";
  THSA.Redundancy.Confirmation failed_A(T=t_c) "Lane A does not follow";
  THSA.Redundancy.Confirmation failed_B(T=t_c) "Lane B does not follow";
  THSA.Redundancy.Confirmation slip_A(T=t_c) "The brake of lane A does not hold";
  THSA.Redundancy.Confirmation slip_B(T=t_c) "The brake of lane B does not hold";
  THSA.Redundancy.Confirmation sensor(T=t_c) "The output's sensor is lost";
  Boolean locked(start=false, fixed=true) "The secondary path is loaded: all drives off, the screw is locked";
  Boolean active_A "Lane A drives the surface";
  Boolean active_B "Lane B drives the surface";
equation
  when F_2^2 > F_lock^2 then
    locked = true;
  end when;
  active_A = not failed_A.y and not locked;
  active_B = failed_A.y and not failed_B.y and not locked;
  failed_A.u = active_A and (w_ref - w_A)^2 > w_err^2;
  failed_B.u = active_B and (w_ref - w_B)^2 > w_err^2;
  slip_A.u = not active_A and not locked and w_A^2 > w_slip^2;
  slip_B.u = not active_B and not locked and w_B^2 > w_slip^2;
  sensor.u = not failed_A.u and not failed_B.u and (w_A + w_B - w_v)^2 > w_dis^2;
  enable_A = active_A or (slip_A.y and not locked);
  enable_B = active_B or (slip_B.y and not locked);
  release_A = active_A;
  release_B = active_B;
  ref_A = if active_A then w_ref else 0;
  ref_B = if active_B then w_ref else 0;
  annotation(
    Documentation(info="<html><p>Lane A drives and lane B stands by, its brake closed. Every finding needs its confirmation
time, and stays.</p>
<ul>
<li>A driving lane whose speed is off its reference has failed, whether its electronics, its resolver, its rotor or its
brake is the reason: its power is taken off, its brake closes, and the other lane drives.</li>
<li>A held lane that moves has a brake that does not hold: its motor holds it at speed 0 instead.</li>
<li>Force on the secondary path says that the primary one is broken: both lanes off, brakes closed, screw locked.</li>
<li>An output sensor that disagrees with motors that follow is reported, and changes nothing: the loops do not use it.</li>
</ul>
<p>A lane that stands still is not noticed while less than w_err is commanded.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={0,60,100}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-80,40},{80,-40}}, textString="monitor", textColor={0,60,100}),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end Monitor;
