model Timer "A timer that a state event starts, and one that the first one starts"
  parameter Real T = 0.1 "Of each timer, s";
  discrete Real t_1(start=-1e9, fixed=true), t_2(start=-1e9, fixed=true);
  Boolean armed, closed, late;
  output Real x(start=0, fixed=true) "2 - 2 exp(-time)";
  output Real z(start=0, fixed=true) "Time since the first timer ended";
  output Real w(start=0, fixed=true) "Time since the second timer ended";
equation
  der(x) = 2 - x;
  armed = x > 0.5;
  when armed then
    t_1 = time;
  end when;
  closed = if time < t_1 + T then not armed else armed;
  when closed then
    t_2 = time;
  end when;
  late = if time < t_2 + T then not closed else closed;
  der(z) = if closed then 1 else 0;
  der(w) = if late then 1 else 0;
end Timer;
