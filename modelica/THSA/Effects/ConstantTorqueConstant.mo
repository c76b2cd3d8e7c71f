within THSA.Effects;
block ConstantTorqueConstant "Torque constant without saturation"
  extends THSA.Interfaces.TorqueConstantEffect;
equation
  g_t = 0;
  g_e = 0;
  annotation(Documentation(info="<html><p>Default of the torque-constant slot.</p></html>"));
end ConstantTorqueConstant;
