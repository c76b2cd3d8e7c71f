within THSA.Effects;
block NoHeating "Winding at the temperature of the box"
  extends THSA.Interfaces.HeatingEffect;
equation
  g_R = 0;
  g_psi = 0;
  annotation(Documentation(info="<html><p>Default of the heating slot.</p></html>"));
end NoHeating;
