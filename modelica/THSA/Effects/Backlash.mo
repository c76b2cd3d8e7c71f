within THSA.Effects;
block Backlash "Clearance between screw and nut"
  extends THSA.Interfaces.ContactEffect;
  parameter Real gap(unit="m", min=0, max=0.1) = 0 "Clearance, from flank to flank";
  parameter Real s_0(unit="1", min=-1, max=1) = 0 "Flank at the start: 1 where the screw pushes forwards, 0 between the flanks";
  final parameter Real h(unit="m") = if gap > 0 then gap/2 else 1 "Half the clearance; out of reach without one";
  final parameter Real o(unit="m") = s_0*gap/2 "Deflection at which the nut is between the flanks, negative";
  final parameter Real c(unit="1") = if gap > 0 then 1 else 0 "1 with a clearance";
equation
  e = if delta + o > h then o - h elseif delta + o < -h then o + h else -c*delta;
  v_e = if delta + o > h or delta + o < -h then 0 else -c*v_s;
  k_e = 0;
  annotation(Documentation(info="<html><p>Dead zone of width gap in the deflection of the contact. At rest under a load one
flank carries, s_0 = &plusmn;1; a nut that was released between them starts at s_0 = 0.</p></html>"));
end Backlash;
