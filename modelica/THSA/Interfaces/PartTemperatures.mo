within THSA.Interfaces;
partial block PartTemperatures "Temperatures of winding, motor, gearbox and screw"
  THSA.Interfaces.RealInput T_amb(unit="degC") "Temperature of the surroundings";
  THSA.Interfaces.RealInput T_motor(unit="degC") "Given temperature of the motor; below absolute zero: none";
  THSA.Interfaces.RealInput T_gearbox(unit="degC") "Given temperature of the gearbox; below absolute zero: none";
  THSA.Interfaces.RealInput T_screw(unit="degC") "Given temperature of the screw; below absolute zero: none";
  THSA.Interfaces.RealInput P_winding(unit="W") "Copper loss";
  THSA.Interfaces.RealInput P_motor(unit="W") "Friction loss of the motor";
  THSA.Interfaces.RealInput P_gearbox(unit="W") "Friction loss of gearbox and no-back device";
  THSA.Interfaces.RealInput P_screw(unit="W") "Friction loss of the nut";
  THSA.Interfaces.RealOutput winding(unit="degC") "Temperature of the winding";
  THSA.Interfaces.RealOutput motor(unit="degC") "Temperature of magnets and bearings";
  THSA.Interfaces.RealOutput gearbox(unit="degC") "Temperature of the gearbox";
  THSA.Interfaces.RealOutput screw(unit="degC") "Temperature of screw and nut";
  annotation(
    Documentation(info="<html><p>Place of thermal models. An input temperature below absolute zero, the start value of the
inputs of <code>Actuator</code>, says that nothing is connected there.</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={191,0,0}, pattern=LinePattern.Dash),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end PartTemperatures;
