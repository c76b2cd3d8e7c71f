within THSA;
package Controllers "Controllers of the power drive electronics"
  annotation(Documentation(info="<html><p>The velocity loop is the law to tune; the current loop is set by the drive.</p></html>"));
end Controllers;
