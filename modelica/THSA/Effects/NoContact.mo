within THSA.Effects;
block NoContact "Contact without clearance or lead error"
  extends THSA.Interfaces.ContactEffect;
equation
  e = 0;
  v_e = 0;
  k_e = 0;
  annotation(Documentation(info="<html><p>Default of the contact slot.</p></html>"));
end NoContact;
