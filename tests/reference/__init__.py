"""An independent plant of the rig: equations written by hand, integrated by SciPy, no FMU and no Modelica."""
