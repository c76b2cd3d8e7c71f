within THSA.Thermal;
block Network "Lumped thermal network: copper, motor, gearbox, screw with nut, surroundings"
  extends THSA.Interfaces.PartTemperatures;
  THSA.Thermal.HeatCapacitor copper(C=400, T_given=-300) "Copper of the winding";
  THSA.Thermal.HeatCapacitor iron(C=4000) "Iron, magnets and housing of the motor";
  THSA.Thermal.HeatCapacitor train(C=8000) "Gear train, its oil and its case";
  THSA.Thermal.HeatCapacitor spindle(C=20000) "Screw and nut";
  THSA.Thermal.Surroundings surroundings "Air and structure";
  THSA.Thermal.ThermalConductor copperToIron(G=8) "Slot insulation";
  THSA.Thermal.ThermalConductor ironToTrain(G=4) "Flange of the motor";
  THSA.Thermal.ThermalConductor trainToSpindle(G=3) "Shaft and bearing of the screw";
  THSA.Thermal.ThermalConductor ironToAir(G=3) "Housing of the motor to the surroundings";
  THSA.Thermal.ThermalConductor trainToAir(G=5) "Case of the gearbox to the surroundings";
  THSA.Thermal.ThermalConductor spindleToAir(G=8) "Screw and nut to the surroundings";
  THSA.Thermal.PrescribedHeatFlow copperLoss "Copper loss";
  THSA.Thermal.PrescribedHeatFlow bearingLoss "Friction loss of the motor";
  THSA.Thermal.PrescribedHeatFlow trainLoss "Friction loss of gearbox and no-back device";
  THSA.Thermal.PrescribedHeatFlow spindleLoss "Friction loss of the nut";
initial equation
  copper.T = motor;
  iron.T = T_amb;
  train.T = T_amb;
  spindle.T = T_amb;
equation
  connect(T_amb, surroundings.T);
  connect(T_motor, iron.T_given);
  connect(T_gearbox, train.T_given);
  connect(T_screw, spindle.T_given);
  connect(P_winding, copperLoss.P);
  connect(P_motor, bearingLoss.P);
  connect(P_gearbox, trainLoss.P);
  connect(P_screw, spindleLoss.P);
  connect(copperLoss.port, copper.port);
  connect(bearingLoss.port, iron.port);
  connect(trainLoss.port, train.port);
  connect(spindleLoss.port, spindle.port);
  connect(copper.port, copperToIron.port_a);
  connect(copperToIron.port_b, iron.port);
  connect(iron.port, ironToTrain.port_a);
  connect(ironToTrain.port_b, train.port);
  connect(train.port, trainToSpindle.port_a);
  connect(trainToSpindle.port_b, spindle.port);
  connect(iron.port, ironToAir.port_a);
  connect(train.port, trainToAir.port_a);
  connect(spindle.port, spindleToAir.port_a);
  connect(ironToAir.port_b, surroundings.port);
  connect(trainToAir.port_b, surroundings.port);
  connect(spindleToAir.port_b, surroundings.port);
  winding = copper.T_part;
  motor = iron.T_part;
  gearbox = train.T_part;
  screw = spindle.T_part;
  annotation(Documentation(info="<html><p>Four heat capacities and six conductances. The actuator starts soaked: every
part at <code>T_amb</code>. A part whose temperature is given (measured) keeps that temperature, and the network computes
the others. The values are assumptions of the size of such an actuator, to be replaced by measured ones; the article has
no thermal model.</p></html>"));
end Network;
