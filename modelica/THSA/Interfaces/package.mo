within THSA;
package Interfaces "Connectors, and the slots that effects plug into"
  annotation(Documentation(info="<html><p>Connectors with the structure of those of the Modelica Standard Library, and the partial blocks of the effects.</p></html>"));
end Interfaces;
