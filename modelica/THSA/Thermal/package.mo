within THSA;
package Thermal "Temperatures of the parts: given ones, or a network that computes them"
  annotation(Documentation(info="<html><p><code>GivenTemperatures</code> takes each part's temperature from an input;
<code>Network</code> computes it from losses and surroundings. Elements and heat ports have the structure of those of
<code>Modelica.Thermal.HeatTransfer</code>.</p></html>"));
end Thermal;
