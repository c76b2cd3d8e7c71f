within THSA;
package Examples "Examples"
  annotation(Documentation(info="<html><p>Closed experiments that run as they are.</p></html>"));
end Examples;
