within THSA.Effects;
block EmpiricalClearance "A dead zone of the contact, for a deflection that no effect with a name explains"
  extends THSA.Effects.Backlash;
  annotation(Documentation(info="<html><p>No physics is meant by it: terms are chosen by what the recordings show, one coefficient
each.</p></html>"));
end EmpiricalClearance;
