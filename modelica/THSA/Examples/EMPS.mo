within THSA.Examples;
model EMPS "Electro-mechanical positioning system: a carriage on a ball screw in closed position loop"
  THSA.Interfaces.RealInput q_ref(unit="m") "Reference of the position";
  THSA.Interfaces.RealInput F_load(unit="N", start=0) "External force, positive opposes positive velocity";
  THSA.Interfaces.RealOutput q(unit="m", nominal=1e-2) "Position";
  THSA.Interfaces.RealOutput v(unit="m/s", nominal=1e-2) "Velocity";
  THSA.Interfaces.RealOutput vir(unit="V") "Voltage as the controller computes it";
  THSA.Interfaces.RealOutput F(unit="N", nominal=10) "Motor force that belongs to vir";
  parameter THSA.Units.Mass M(min=1e-3, max=1e4) = 95.1089 "Moving mass with the motor's inertia";
  parameter THSA.Units.Damping F_v(min=-1e6, max=1e6) = 203.5034 "Viscous friction coefficient";
  parameter THSA.Units.Force F_c(min=0, max=1e5) = 20.3935 "Coulomb friction";
  parameter THSA.Units.Force F_0(min=-1e5, max=1e5) = -3.1648 "Offset of the motor force";
  parameter Real c(unit="N/m", min=-1e6, max=1e6) = 0 "Stiffness of a spring along the stroke, such as a cable carrier";
  parameter Real c_1(unit="N/m", min=-1e6, max=1e6) = 0 "Change of Coulomb friction along the stroke";
  parameter Real g_tau(unit="N/V", min=1e-3, max=1e5) = 35.15065188248547 "Motor force per voltage";
  THSA.Controllers.CascadeController controller "Position and velocity loop";
  THSA.Friction friction(v(unit="m/s"), F_C(unit="N"), b_v(unit="N.s/m"), F_f(unit="N"),
    b_q(unit="N.s2/m2", min=-1e9, max=1e9), v_S(unit="m/s", max=1) = 1e-3, v_r(unit="m/s", max=1e-3) = 1e-6)
    "Friction of guide and screw";
  replaceable THSA.Effects.NoFriction guideEffect(v(unit="m/s"), z(unit="m"), N(unit="N"), F(unit="N"))
    constrainedby THSA.Interfaces.FrictionEffect
    "Slot: friction and forces of guide and screw";
  THSA.Units.Position s(nominal=1e-2) "Position of the carriage";
  THSA.Units.Velocity w(nominal=1e-2) "Velocity of the carriage";
  THSA.Units.Force F_m "Motor force on the carriage";
initial equation
  s = q_ref;
  w = 0;
equation
  q = s;
  v = w;
  connect(q_ref, controller.reference);
  controller.q = s;
  controller.v = w;
  connect(controller.y, vir);
  F = g_tau*vir;
  F_m = g_tau*controller.y_held;
  friction.v = w;
  friction.F_C = F_c + c_1*s;
  friction.b_v = F_v;
  guideEffect.v = w;
  guideEffect.s = friction.s;
  guideEffect.z = s;
  guideEffect.N = F_m;
  der(s) = w;
  M*der(w) = F_m - friction.F_f - guideEffect.F - F_0 - F_load - c*s;
  annotation(
    experiment(StartTime=0, StopTime=24.84, Tolerance=1e-6, Interval=1e-3),
    Documentation(info="<html>
<p>The drive of the EMPS benchmark (A. Janot, M. Gautier, M. Brunot, <em>Data Set and Reference Models of EMPS</em>,
Workshop on Nonlinear System Identification Benchmarks, 2019): a DC motor moves a carriage by a ball screw. M, F_v, F_c
and F_0 are the published estimates of the symmetric model; c and c_1, which it has not, are 0.</p>
<p>F is what the record calls motor force, g_tau vir; at the carriage it acts half a sample later. The drive starts at rest
on the reference; its loops forget the start within 0.1 s.</p></html>"),
    Icon(graphics={Rectangle(extent={{-90,-20},{90,-40}}, lineColor={0,0,0}, fillColor={160,160,164}, fillPattern=FillPattern.Solid),
      Rectangle(extent={{-40,40},{40,-20}}, lineColor={0,0,0}, fillColor={220,230,240}, fillPattern=FillPattern.Solid),
      Text(extent={{-100,100},{100,65}}, textString="%name", textColor={0,0,255})}));
end EMPS;
