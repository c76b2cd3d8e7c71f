within THSA.Benches;
model Screw "Screw bench: a load cell drives nut and screw alone"
  THSA.Interfaces.RealInput v(unit="m/s") "Velocity of the nut";
  THSA.Interfaces.RealInput T_amb(unit="degC", start=25, min=-90, max=150) "Temperature of the screw";
  THSA.Interfaces.RealOutput F(unit="N", nominal=1e3) "Force of the load cell";
  THSA.Benches.LoadCellDrive drive "Load cell";
  THSA.Nut nut "Nut";
equation
  connect(v, drive.v);
  connect(drive.flange, nut.flange_b);
  connect(T_amb, nut.T);
  connect(drive.F, F);
  annotation(
    experiment(StartTime=0, StopTime=16, Tolerance=1e-6, Interval=1e-2),
    Documentation(info="<html><p>Kind 3 of the experiments: F = F_fn sgn(v) + b_n v; shows F_fn and b_n.</p></html>"));
end Screw;
