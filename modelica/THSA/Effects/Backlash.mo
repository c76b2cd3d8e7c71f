within THSA.Effects;
block Backlash "Clearance between screw and nut"
  extends THSA.Interfaces.ContactEffect;
  parameter Real gap(unit="m", min=0, max=0.1) = 0 "Clearance, from flank to flank";
equation
  e = if gap > 0 then (if delta > gap/2 then -gap/2 elseif delta < -gap/2 then gap/2 else -delta) else 0;
  v_e = if gap > 0 then (if delta > gap/2 or delta < -gap/2 then 0 else -v_s) else 0;
  annotation(Documentation(info="<html><p>Dead zone of width gap in the deflection of the contact.</p></html>"));
end Backlash;
