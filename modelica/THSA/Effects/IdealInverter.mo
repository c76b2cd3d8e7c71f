within THSA.Effects;
block IdealInverter "Inverter that applies the commanded voltage"
  extends THSA.Interfaces.VoltageEffect;
equation
  du = 0;
  annotation(Documentation(info="<html><p>Default of the voltage slot.</p></html>"));
end IdealInverter;
