within THSA.Thermal;
block GivenTemperatures "Each part has its given temperature, or that of the surroundings"
  extends THSA.Interfaces.PartTemperatures;
equation
  winding = motor;
  motor = if noEvent(T_motor > -273.15) then T_motor else T_amb;
  gearbox = if noEvent(T_gearbox > -273.15) then T_gearbox else T_amb;
  screw = if noEvent(T_screw > -273.15) then T_screw else T_amb;
  annotation(Documentation(info="<html><p>For measured temperatures, and for a box at one temperature: with nothing
connected every part is at <code>T_amb</code>. The losses warm nothing.</p></html>"));
end GivenTemperatures;
