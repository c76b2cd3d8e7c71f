within THSA;
package Interfaces "Connectors"
  annotation(Documentation(info="<html><p>Connectors with the structure of those of the Modelica Standard Library.</p></html>"));
end Interfaces;
