within THSA.Interfaces;
connector HeatPort "Thermal port for one-dimensional heat transfer"
  THSA.Units.AbsoluteTemperature T "Temperature of the port";
  flow THSA.Units.HeatFlowRate Q_flow "Heat flow rate, positive into the component";
  annotation(Icon(graphics={Rectangle(extent={{-100,100},{100,-100}}, lineColor={191,0,0}, fillColor={191,0,0}, fillPattern=FillPattern.Solid)}),
    Documentation(info="<html><p>Structure of <code>Modelica.Thermal.HeatTransfer.Interfaces.HeatPort_a</code>.</p></html>"));
end HeatPort;
