within THSA.Effects;
block Backlash "Clearance between screw and nut"
  extends THSA.Interfaces.ContactEffect;
  parameter Real gap(unit="m", min=0, max=0.1) = 0 "Clearance, from flank to flank";
  final parameter Real h(unit="m") = if gap > 0 then gap/2 else 1 "Half the clearance; out of reach without one";
  final parameter Real c(unit="1") = if gap > 0 then 1 else 0 "1 with a clearance";
equation
  e = if delta > h then -h elseif delta < -h then h else -c*delta;
  v_e = if delta > h or delta < -h then 0 else -c*v_s;
  k_e = 0;
  annotation(Documentation(info="<html><p>Dead zone of width gap in the deflection of the contact.</p></html>"));
end Backlash;
