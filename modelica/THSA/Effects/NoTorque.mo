within THSA.Effects;
block NoTorque "Shaft without further torque"
  extends THSA.Interfaces.ShaftEffect;
equation
  tau = 0;
  annotation(Documentation(info="<html><p>Default of the shaft's slot.</p></html>"));
end NoTorque;
