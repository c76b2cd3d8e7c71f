within THSA.Thermal;
model Surroundings "Heat port at the temperature of the surroundings"
  THSA.Interfaces.RealInput T(unit="degC") "Temperature";
  THSA.Interfaces.HeatPort port "Heat port";
equation
  port.T = T + 273.15;
  annotation(
    Documentation(info="<html><p>As <code>Modelica.Thermal.HeatTransfer.Celsius.PrescribedTemperature</code>.</p></html>"),
    Icon(graphics={Rectangle(extent={{-80,80},{80,-80}}, lineColor={191,0,0}, fillColor={159,159,223}, fillPattern=FillPattern.Backward),
      Text(extent={{-100,140},{100,105}}, textString="%name", textColor={0,0,255})}));
end Surroundings;
