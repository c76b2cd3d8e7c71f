within THSA.Thermal;
model HeatCapacitor "Lumped heat capacity, whose temperature may be given instead"
  THSA.Interfaces.HeatPort port "Heat port";
  THSA.Interfaces.RealInput T_given(unit="degC") "Measured temperature; below absolute zero: none, it is computed";
  parameter THSA.Units.HeatCapacity C(min=1e-3, max=1e9) = 1000 "Heat capacity";
  THSA.Units.Temperature T(nominal=10) "Temperature that the heat flows make";
  THSA.Units.Temperature T_part "Temperature of the part";
equation
  C*der(T) = if noEvent(T_given > -273.15) then 0 else port.Q_flow;
  T_part = if noEvent(T_given > -273.15) then T_given else T;
  port.T = T_part + 273.15;
  annotation(
    Documentation(info="<html><p>C dT/dt = Q_flow, as <code>Modelica.Thermal.HeatTransfer.Components.HeatCapacitor</code>.
Where a sensor gives the part's temperature the port has that temperature, and takes whatever heat flows.</p></html>"),
    Icon(graphics={Ellipse(extent={{-80,80},{80,-80}}, lineColor={191,0,0}, fillColor={235,220,220}, fillPattern=FillPattern.Solid),
      Text(extent={{-60,30},{60,-30}}, textString="C"),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end HeatCapacitor;
