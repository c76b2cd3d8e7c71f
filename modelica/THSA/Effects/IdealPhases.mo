within THSA.Effects;
block IdealPhases "Equal phases without offset"
  extends THSA.Interfaces.PhaseEffect;
equation
  d = 0;
  du = 0;
  annotation(Documentation(info="<html><p>Default of the slot for phases.</p></html>"));
end IdealPhases;
