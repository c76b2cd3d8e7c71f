package Corpus "Small models with closed forms: what the exporter has to get right"
  package Parts "What the models are made of"
    connector Flange
      Real phi;
      flow Real tau;
    end Flange;
    model Inertia
      parameter Real J = 1;
      Flange a;
      Flange b;
      Real phi;
      Real w;
    equation
      phi = a.phi;
      phi = b.phi;
      w = der(phi);
      J*der(w) = a.tau + b.tau;
    end Inertia;
    model Spring
      parameter Real c = 1;
      Flange a;
      Flange b;
    equation
      a.tau = c*(a.phi - b.phi);
      b.tau = -a.tau;
    end Spring;
    model Decay
      parameter Real k = 1;
      Real x(start=1, fixed=true);
    equation
      der(x) = -k*x;
    end Decay;
    partial model Friction
      input Real v;
      output Real f;
    end Friction;
    model Linear
      extends Friction;
    equation
      f = v;
    end Linear;
    model Double
      extends Friction;
      parameter Real k = 2;
    equation
      f = k*v;
    end Double;
    model MassOfClass
      replaceable model Law = Linear constrainedby Friction;
      Law law;
      Real v(start=1, fixed=true);
    equation
      law.v = v;
      der(v) = -law.f;
    end MassOfClass;
    model MassOfComponent
      replaceable Linear law constrainedby Friction;
      Real v(start=1, fixed=true);
    equation
      law.v = v;
      der(v) = -law.f;
    end MassOfComponent;
    model Around
      MassOfClass m;
    end Around;
    model AroundComponent
      MassOfComponent m;
    end AroundComponent;
    model World
      parameter Real g = 9.81;
    end World;
    model Body
      outer World world;
      Real v(start=0, fixed=true);
    equation
      der(v) = -world.g;
    end Body;
    record Data
      parameter Real R = 1;
      parameter Real L = 2;
    end Data;
    model Coil
      parameter Data data;
      Real i(start=1, fixed=true);
    equation
      data.L*der(i) = -data.R*i;
    end Coil;
    type Mode = enumeration(off, slow, fast);
    function cube
      input Real a;
      output Real b;
    protected
      Real c;
    algorithm
      c := a*a;
      b := c*a;
    end cube;
    function polynomial "Horner's scheme"
      input Real p[:];
      input Real x;
      output Real y;
    algorithm
      y := 0;
      for i in size(p, 1):-1:1 loop
        y := y*x + p[i];
      end for;
    end polynomial;
    function saturated
      input Real u;
      output Real y;
      output Boolean active;
    algorithm
      active := true;
      if u > 1 then
        y := 1;
        return;
      elseif u < -1 then
        y := -1;
        return;
      end if;
      y := u;
      active := false;
    end saturated;
  end Parts;

  model LoopOverDerivatives
    Real T[5](each start=0, each fixed=true);
  equation
    for i in 1:5 loop
      der(T[i]) = i*(1 - T[i]);
    end for;
  end LoopOverDerivatives;

  model RedeclaredModel
    Parts.MassOfClass m(redeclare model Law = Parts.Double);
  end RedeclaredModel;

  model RedeclaredNested
    Parts.Around s(m(redeclare model Law = Parts.Double(k=3)));
  end RedeclaredNested;

  model RedeclaredComponent
    Parts.AroundComponent s(m(redeclare Parts.Double law(k=4)));
  end RedeclaredComponent;

  model RedeclaredByExtension
    extends Parts.MassOfComponent(redeclare Parts.Double law);
  end RedeclaredByExtension;

  model FinalBoolean
    parameter Real k = 1;
    final parameter Boolean high = k > 0.5;
    Real x(start=0, fixed=true);
  equation
    der(x) = if high then 1 else 2;
  end FinalBoolean;

  model Vectors
    parameter Real k[3] = {1, 2, 3};
    Real x[3](start={1, 2, 3}, each fixed=true);
    Real s;
    Real d;
    Real tail[2];
  equation
    der(x) = -k.*x;
    s = sum(x);
    d = k*x;
    tail = x[2:end];
  end Vectors;

  model Matrices
    parameter Real A[2, 2] = [0, 1; -1, 0];
    Real x[2](start={1, 0}, each fixed=true);
    Real B[2, 2];
    Real t;
  equation
    der(x) = A*x;
    B = A*transpose(A) + identity(2)*x[1];
    t = sum(B[i, i] for i in 1:2);
  end Matrices;

  model Functions
    Real x(start=1, fixed=true);
    Real p;
    Real y;
    Boolean active;
  equation
    der(x) = -Parts.cube(x);
    p = Parts.polynomial({1, 2, 3}, x);
    (y, active) = Parts.saturated(4*x);
  end Functions;

  model Enumerations
    parameter Parts.Mode mode = Parts.Mode.fast;
    parameter String label = "not a number";
    parameter Real rate[Parts.Mode] = {0, 1, 5};
    Real x(start=1, fixed=true);
  equation
    der(x) = -(if mode == Parts.Mode.fast then rate[Parts.Mode.fast] else 0)*x;
  end Enumerations;

  model Chain
    parameter Integer n = 3;
    Parts.Inertia j[n](each J=1, each phi(start=0, fixed=true), w(start={1, 0, 0}, each fixed=true));
    Parts.Spring s[n - 1](each c=4);
  equation
    for i in 1:n - 1 loop
      connect(j[i].b, s[i].a);
      connect(s[i].b, j[i + 1].a);
    end for;
  end Chain;

  model Rigid
    Parts.Inertia j1(J=1, w(start=6, fixed=true), phi(start=0, fixed=true));
    Parts.Inertia j2(J=2);
  equation
    connect(j1.b, j2.a);
  end Rigid;

  model Environment
    inner Parts.World world(g=5);
    Parts.Body body;
  end Environment;

  model Conditional
    parameter Boolean on = false;
    Parts.Decay a if on;
    Parts.Decay b(k=2) if not on;
  end Conditional;

  model Records
    parameter Parts.Data d(R=4);
    Parts.Coil coil(data=d);
  end Records;

  model BouncingBall
    parameter Real e = 0.5;
    Real h(start=1, fixed=true);
    Real v(start=0, fixed=true);
    Integer n(start=0, fixed=true);
  equation
    der(h) = v;
    der(v) = -10;
    when h < 0 then
      reinit(v, -e*pre(v));
      n = pre(n) + 1;
    end when;
  end BouncingBall;

  model SampledController "x[k+1] = x[k] + T*u[k], u[k] = -K*x[k]"
    parameter Real K = 2;
    discrete Real u(start=0, fixed=true);
    Real x(start=1, fixed=true);
    Integer ticks(start=0, fixed=true);
  equation
    der(x) = u;
    when sample(0, 0.1) then
      u = -K*x;
      ticks = pre(ticks) + 1;
    end when;
  end SampledController;

  model Latch
    Real x(start=0, fixed=true);
    Boolean up(start=true, fixed=true);
    Integer turns(start=0, fixed=true);
  equation
    der(x) = if up then 1 else -1;
    when x > 0.3 then
      up = false;
      turns = pre(turns) + 1;
    elsewhen x < 0.1 then
      up = true;
      turns = pre(turns) + 10;
    end when;
  end Latch;

  model EdgeAndChange
    Boolean b = time > 0.25 and time < 0.75;
    Integer rising(start=0, fixed=true);
    Integer changes(start=0, fixed=true);
  equation
    when edge(b) then
      rising = pre(rising) + 1;
    end when;
    when change(b) then
      changes = pre(changes) + 1;
    end when;
  end EdgeAndChange;

  model Rounding
    Integer n = integer(10*time);
    Real m = mod(time, 0.25);
    Real f = floor(-3*time);
    Real c = ceil(3*time);
  end Rounding;

  model Algorithm
    Real x(start=1, fixed=true);
    Real y;
    discrete Real last(start=0, fixed=true);
  equation
    der(x) = -y;
  algorithm
    y := 2*x;
    y := y + 1;
    when time > 0.5 then
      last := x;
    end when;
  end Algorithm;

  model Implicit "exp(y) + y = x"
    Real x(start=1, fixed=true);
    Real y(start=0);
  equation
    der(x) = 1;
    exp(y) + y = x;
  end Implicit;

  model NonlinearLoop
    Real a;
    Real b;
    Real q(start=1);
    Real x(start=0.2, fixed=true);
  equation
    der(x) = 0.1;
    a = 0.5*cos(b) + x;
    b = 0.5*sin(a);
    2*q*abs(q) = x + 1;
  end NonlinearLoop;

  model OtherRoot "the start value chooses the root"
    Real q(start=-1);
    Real x(start=4, fixed=true);
  equation
    der(x) = 5;
    q^2 = x;
  end OtherRoot;

  model FreeParameter
    parameter Real p(fixed=false, start=1);
    Real x(start=1, fixed=true);
    Real y(start=0, fixed=true);
  initial equation
    der(x) = 0;
  equation
    der(x) = p - 2*x;
    der(y) = p;
  end FreeParameter;

  model SteadyStart
    parameter Real k = 4;
    Real x(start=5);
  initial equation
    der(x) = 0;
  equation
    der(x) = -2*x + k;
  end SteadyStart;

  model Initially
    Real x(start=0, fixed=true);
    discrete Real y(start=3);
  equation
    der(x) = if initial() then 5 else 1;
    when initial() then
      y = 7;
    end when;
  end Initially;

  model Pendulum "Cartesian, once around"
    Real x(start=0, fixed=true);
    Real y(start=-1);
    Real vx(start=7, fixed=true);
    Real vy;
    Real F;
  equation
    der(x) = vx;
    der(y) = vy;
    der(vx) = -F*x;
    der(vy) = -F*y - 9.81;
    x^2 + y^2 = 1;
  end Pendulum;

  model Names "no name of a model meets one of the C code"
    parameter Real mode[2] = {3, 4};
    Real double(start=1, fixed=true);
    Real x_start_0;
    Real sx_0;
    Real q = if x_start_0 > 0.5 then mode[1] else mode[2];
  equation
    der(double) = -double;
    x_start_0 = 3*double;
    sx_0 = x_start_0 + 1;
  end Names;

  model Edges "a relation that holds with equality at the start"
    Real early = if time >= 0 then 1 else 2;
    Real late = if time > 0 then 1 else 2;
    Real x(start=0, fixed=true);
  equation
    der(x) = late;
  end Edges;

  model BigLoop "five linear equations with a mode"
    Real z[5];
    Real s = if time > 0.5 then 2 else 1;
    Real x(start=0, fixed=true);
  equation
    der(x) = z[1];
    for i in 1:5 loop
      (3 + i)*s*z[i] + sum(z) = i;
    end for;
  end BigLoop;

  model Pivots "a loop of linear equations whose rows have to change places"
    parameter Real p = 1;
    Real x(start=1, fixed=true);
    Real y[4];
  equation
    der(x) = -y[1];
    p*(y[3] + y[4]) = 7*x;
    p*(y[1] + y[4]) = 5*x;
    p*(y[1] + y[2]) = 3*x;
    p*(y[2] + 2*y[3]) = 8*x;
  end Pivots;

  model Leaving "return and break under conditions that are not known at export"
    function first "Index of the first number above a limit, 0 if there is none"
      input Real u[:];
      input Real limit;
      output Real y;
    algorithm
      y := 0;
      for i in 1:size(u, 1) loop
        if u[i] > limit then
          y := i;
          return;
        end if;
      end for;
    end first;
    function count "Numbers before the first one above a limit"
      input Real u[:];
      input Real limit;
      output Real y;
    algorithm
      y := 0;
      for i in 1:size(u, 1) loop
        if u[i] > limit then
          break;
        end if;
        y := y + 1;
      end for;
      y := 10*y;
    end count;
    Real f = first({time - 1, 2*time, 3}, 1);
    Real c = count({time - 1, 2*time, 3}, 1);
  end Leaving;

  model Simplified "homotopy leads to one of three solutions"
    Real y(start=0.1);
  equation
    homotopy(actual=y^3 - 4*y, simplified=y + 10) = 0;
  end Simplified;

  model NoLoss "a parameter that is 0 takes a part away"
    parameter Real G = 0;
    Real x(start=1, fixed=true);
    Real v;
    Real i;
  equation
    der(x) = -v - i;
    v = 2*x;
    if G <= 0 then
      i = 0;
    else
      i = G*v;
    end if;
  end NoLoss;

  model Held "noEvent() around a variable leaves the events of its own equation"
    Boolean early = time < 0.5;
    Real x(start=0, fixed=true);
  equation
    der(x) = noEvent(if early and not time > 0.8 then 1 else 2);
  end Held;

  model All "one of each, so that one FMU tests them"
    LoopOverDerivatives loopOverDerivatives;
    RedeclaredModel redeclaredModel;
    RedeclaredNested redeclaredNested;
    RedeclaredComponent redeclaredComponent;
    RedeclaredByExtension redeclaredByExtension;
    FinalBoolean finalBoolean;
    Vectors vectors;
    Matrices matrices;
    Functions functions;
    Enumerations enumerations;
    Chain chain;
    Rigid rigid;
    Environment environment;
    Conditional conditional;
    Records records;
    BouncingBall bouncingBall;
    SampledController sampledController;
    Latch latch;
    EdgeAndChange edgeAndChange;
    Rounding rounding;
    Algorithm algorithm_;
    Implicit implicit;
    NonlinearLoop nonlinearLoop;
    OtherRoot otherRoot;
    FreeParameter freeParameter;
    SteadyStart steadyStart;
    Initially initially;
    Pendulum pendulum;
    Names names;
    Edges edges;
    BigLoop bigLoop;
    Pivots pivots;
    Leaving leaving;
    Simplified simplified;
    NoLoss noLoss;
    Held held;
    annotation(experiment(StopTime=1, Tolerance=1e-8));
  end All;
end Corpus;
