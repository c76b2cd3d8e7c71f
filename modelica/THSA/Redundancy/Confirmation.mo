within THSA.Redundancy;
block Confirmation "Latches once a condition has held for a time"
  THSA.Interfaces.BooleanInput u "Condition";
  THSA.Interfaces.BooleanOutput y "Confirmed, and latched";
  parameter THSA.Units.Time T(min=1e-4, max=100) = 0.1 "Time for which the condition must hold";
  Boolean held(start=false, fixed=true) "The condition has held for that time";
  discrete Real t_0(unit="s", start=0, fixed=true) "Time at which the condition became true";
equation
  when u then
    t_0 = time;
  end when;
  when u and time >= t_0 + T then
    held = true;
  end when;
  y = pre(held); // the condition may depend on it
  annotation(
    Documentation(info="<html><p>Two events for each confirmation, and one wherever the condition comes and goes. A condition
that holds from the start counts from time 0.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={0,60,100}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-80,40},{80,-40}}, textString="T", textColor={0,60,100}),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end Confirmation;
