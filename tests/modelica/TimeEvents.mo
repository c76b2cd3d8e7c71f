model TimeEvents "Relations of time alone, whose instants fall on communication points"
  parameter Real t0 = 0.3;
  Real x(start=0, fixed=true);
  Real w(start=0, fixed=true);
  output Real from;
  output Real after;
  output Real scaled;
  output Real wave;
  discrete Integer n(start=0, fixed=true);
  discrete Real next(start=0.1, fixed=true);
equation
  from = if time >= t0 then 1 else 0;
  after = if time > t0 then 1 else 0;
  scaled = if (time - t0)/7 < 1/70 then 0 else 1;
  wave = if sin(10*time) > 0 then 1 else 0;
  der(x) = from;
  der(w) = if time < 0.5 then 1 else -1;
  when time >= pre(next) then
    n = pre(n) + 1;
    next = pre(next) + 0.1;
  end when;
end TimeEvents;
