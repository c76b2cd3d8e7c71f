within THSA;
package Units "Types with SI units"
  type Time = Real(final quantity="Time", final unit="s") "Time";
  type Angle = Real(final quantity="Angle", final unit="rad") "Angle";
  type AngularVelocity = Real(final quantity="AngularVelocity", final unit="rad/s") "Angular velocity";
  type Position = Real(final quantity="Length", final unit="m") "Position";
  type Length = Real(final quantity="Length", final unit="m") "Length";
  type Velocity = Real(final quantity="Velocity", final unit="m/s") "Velocity";
  type Torque = Real(final quantity="Torque", final unit="N.m") "Torque";
  type Force = Real(final quantity="Force", final unit="N") "Force";
  type Mass = Real(final quantity="Mass", final unit="kg") "Mass";
  type Inertia = Real(final quantity="MomentOfInertia", final unit="kg.m2") "Moment of inertia";
  type Stiffness = Real(final quantity="TranslationalSpringConstant", final unit="N/m") "Stiffness";
  type Damping = Real(final quantity="TranslationalDampingConstant", final unit="N.s/m") "Damping";
  type Current = Real(final quantity="ElectricCurrent", final unit="A") "Current";
  type Voltage = Real(final quantity="ElectricPotential", final unit="V") "Voltage";
  type Inductance = Real(final quantity="Inductance", final unit="H") "Inductance";
  type Power = Real(final quantity="Power", final unit="W") "Power";
  type Temperature = Real(final quantity="ThermodynamicTemperature", final unit="degC") "Temperature in degrees Celsius";
  type AbsoluteTemperature = Real(final quantity="ThermodynamicTemperature", final unit="K", min=0) "Temperature of a heat port";
  type HeatFlowRate = Real(final quantity="Power", final unit="W") "Heat flow rate";
  type HeatCapacity = Real(final quantity="HeatCapacity", final unit="J/K") "Heat capacity";
  type ThermalConductance = Real(final quantity="ThermalConductance", final unit="W/K") "Thermal conductance";
  type Energy = Real(final quantity="Energy", final unit="J") "Energy";
  type TorqueConstant = Real(final quantity="ElectricalTorqueConstant", final unit="N.m/A") "Torque constant";
  type Ratio = Real(final quantity="Ratio", final unit="1") "Dimensionless ratio";
  annotation(Documentation(info="<html><p>Quantities as in <code>Modelica.Units.SI</code>, except that temperature is
in degrees Celsius, the unit of the published laws; only heat ports have it in kelvin.</p></html>"));
end Units;
