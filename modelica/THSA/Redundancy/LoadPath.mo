within THSA.Redundancy;
model LoadPath "Path of the force from screw to stabilizer: stiff, damped, with play; it can break"
  THSA.Interfaces.RotationalFlange flange_a "Screw shaft";
  THSA.Interfaces.TranslationalFlange flange_b "Nut";
  input THSA.Units.Length e = 0 "Added deflection of the contact";
  input THSA.Units.Velocity v_e = 0 "Its rate";
  input Real k_e(unit="m/rad") = 0 "Its change with the screw's angle";
  parameter THSA.Units.Length P_h(min=1e-5, max=1) = 10e-3 "Lead";
  parameter THSA.Units.Stiffness k_s(min=1, max=1e12) = 3.0e8 "Contact stiffness";
  parameter THSA.Units.Damping d_s(min=0, max=1e9) = 5.0e5 "Contact damping";
  parameter THSA.Units.Length gap(min=0, max=0.1) = 0 "Play, from one flank to the other";
  parameter THSA.Units.Time t_rupture(min=-1, max=1e9) = 1e9 "Failure: time at which the path breaks";
  final parameter Real k(unit="m/rad") = P_h/(2*3.141592653589793) "Travel per angle";
  Boolean broken(start=false, fixed=true) "The path is broken";
  THSA.Units.Force F_s "Force on the nut";
  THSA.Units.Length delta "Screw ahead of the nut";
  THSA.Units.Velocity v_s "Its rate";
  THSA.Units.Length deflection "Deflection with what is added";
  THSA.Units.Length squeeze "Deflection beyond the play";
  THSA.Units.Ratio touch "1 where the flanks touch, 0 within the play";
  THSA.Units.Power P_d "Loss of the contact";
  THSA.Units.Energy E "Elastic energy; of a broken path what the break took";
  discrete Real E_b(unit="J", start=0, fixed=true) "Elastic energy at the break";
equation
  v_s = k*der(flange_a.phi) - der(flange_b.s);
  delta = k*flange_a.phi - flange_b.s;
  deflection = delta + e;
  squeeze = if deflection > gap/2 then deflection - gap/2 elseif deflection < -gap/2 then deflection + gap/2 else 0;
  touch = if deflection > gap/2 then 1 elseif deflection < -gap/2 then 1 else 0;
  F_s = if broken then 0 else k_s*squeeze + d_s*touch*(v_s + v_e);
  P_d = if broken then 0 else d_s*touch*(v_s + v_e)^2;
  E = if broken then E_b else 0.5*k_s*squeeze^2;
  when time >= t_rupture then
    broken = true;
    E_b = 0.5*k_s*squeeze^2;
  end when;
  flange_a.tau = (k + k_e)*F_s;
  flange_b.f = -F_s;
  annotation(
    Documentation(info="<html><p>As <code>Screw</code>, with play and rupture. Two of them in parallel make the two load paths:
the primary one has no play and carries the force; the secondary one, with more play, is loaded once the primary one is
broken.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={0,60,100}, fillColor={255,255,255}, fillPattern=FillPattern.Solid),
      Text(extent={{-80,40},{80,-40}}, textString="path", textColor={0,60,100}),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end LoadPath;
