within THSA.Benches;
model Gearbox "Gearbox bench: a load cell drives nut, screw and gearbox, no-back released, motor off"
  THSA.Interfaces.RealInput v(unit="m/s") "Velocity of the nut";
  THSA.Interfaces.RealInput T_amb(unit="degC", start=25, min=-90, max=150) "Temperature of gearbox and screw";
  THSA.Interfaces.RealOutput F(unit="N", nominal=1e3) "Force of the load cell";
  THSA.Benches.LoadCellDrive drive "Load cell";
  THSA.Nut nut "Nut";
  THSA.RigidScrew screw "Roller screw";
  THSA.Gearbox gearbox "Gearbox";
equation
  connect(v, drive.v);
  connect(drive.flange, nut.flange_b);
  connect(nut.flange_a, screw.flange_b);
  connect(screw.flange_a, gearbox.flange_b);
  connect(T_amb, nut.T);
  connect(T_amb, gearbox.T);
  connect(drive.F, F);
  annotation(
    experiment(StartTime=0, StopTime=16, Tolerance=1e-6, Interval=1e-2),
    Documentation(info="<html><p>Kind 2 of the experiments: F = F_fn sgn(v) + b_n v + (T_fg sgn(v) + b_g v/k)/k; shows
T_fg and b_g once the screw is known.</p></html>"));
end Gearbox;
