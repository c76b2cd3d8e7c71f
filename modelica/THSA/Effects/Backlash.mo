within THSA.Effects;
block Backlash "Clearance between screw and nut"
  extends THSA.Interfaces.ContactEffect;
  parameter Real gap(unit="m", min=0, max=0.1) = 0 "Clearance, from flank to flank";
  parameter Real s_0(unit="1", min=0, max=1) = 0 "Share of its half that the load has taken up at the start";
  final parameter Real h(unit="m") = if gap > 0 then gap/2 else 1 "Half the clearance; out of reach without one";
  final parameter Real c(unit="1") = if gap > 0 then 1 else 0 "1 with a clearance";
  Real o(unit="m", nominal=1e-5) "Deflection that the load took up";
initial equation
  o = s_0*gap/2*(if delta > 0 then 1 elseif delta < 0 then -1 else 0);
equation
  der(o) = 0;
  e = if delta + o > h then (if delta + o - h + t_d*v_s > 0 then o - h else -c*delta)
    elseif delta + o < -h then (if delta + o + h + t_d*v_s < 0 then o + h else -c*delta) else -c*delta;
  v_e = if delta + o > h then (if delta + o - h + t_d*v_s > 0 then 0 else -c*v_s)
    elseif delta + o < -h then (if delta + o + h + t_d*v_s < 0 then 0 else -c*v_s) else -c*v_s;
  k_e = 0;
  annotation(Documentation(info="<html><p>Dead zone of width gap in the deflection of the contact. At rest under a load one
flank carries, s_0 = 1; a nut that was released between the flanks starts with s_0 = 0. A flank only pushes: as it parts, it lets go where stiffness
and damping together would pull, as in <code>Modelica.Mechanics.Rotational.Components.ElastoBacklash</code>; with t_d = 0, where a
model does not say what its contact's damping is, the damping acts until the flank has parted.</p></html>"));
end Backlash;
