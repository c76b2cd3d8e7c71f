"""What is wrong with recordings, before anything is fitted to them.

``finding``  a finding, and all of them with their verdict
``file``     a recording's file without a scenario
``recording`` all detectors over a scenario's recordings; they stand in ``time_axis`` and, by what they look at,
             in ``samples``, ``outliers``, ``stretches``, ``spectrum``, ``course`` and ``across``
``trust``    whether a fit leaves nothing but noise
``misfit``   which slip of a signal explains what a fit leaves
"""

from thsa_cosim.inspection.file import FileReport, inspect_file
from thsa_cosim.inspection.finding import Finding, Inspection
from thsa_cosim.inspection.misfit import misfits
from thsa_cosim.inspection.recording import inspect
from thsa_cosim.inspection.trust import Residual, Trust, judge, judge_ratios

__all__ = [
    "FileReport",
    "Finding",
    "Inspection",
    "Residual",
    "Trust",
    "inspect",
    "inspect_file",
    "judge",
    "judge_ratios",
    "misfits",
]
