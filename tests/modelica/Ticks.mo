model Ticks "No states: time events between the rows of a result"
  output Integer m(start=0, fixed=true);
  discrete Integer n(start=0, fixed=true);
  discrete Real next(start=0.1, fixed=true);
  output Real y;
equation
  y = n + (if time >= 0.5 then 10 else 0);
  when time >= pre(next) then
    n = pre(n) + 1;
    next = pre(next) + 0.1;
  end when;
  when sample(0, 0.1) then
    m = pre(m) + 1;
  end when;
end Ticks;
