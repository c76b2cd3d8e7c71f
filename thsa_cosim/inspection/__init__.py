"""What is wrong with recordings, before anything is fitted to them.

``finding``  a finding, and all of them with their verdict
``file``     a recording's file without a scenario
``recording`` all detectors over a scenario's recordings; they stand in ``time_axis`` and, by what they look at,
             in ``samples``, ``outliers``, ``stretches``, ``levels``, ``spectrum``, ``jumps``,
             ``course``, ``across``, ``pairs`` and ``time_unit``
``trust``    whether a fit leaves nothing but noise
``misfit``   which slip of a signal explains what a fit leaves
``influence`` which samples an identified value hangs on
``hidden``   which gain of a sensor a fit cannot see, because parameters take it up
"""

from thsa_cosim.inspection.file import FileReport, inspect_file
from thsa_cosim.inspection.finding import Finding, Inspection
from thsa_cosim.inspection.hidden import Expected, hidden_gains
from thsa_cosim.inspection.influence import influences
from thsa_cosim.inspection.misfit import misfits
from thsa_cosim.inspection.recording import inspect
from thsa_cosim.inspection.trust import Residual, Trust, judge, judge_ratios

__all__ = [
    "Expected",
    "FileReport",
    "Finding",
    "Inspection",
    "Residual",
    "Trust",
    "hidden_gains",
    "influences",
    "inspect",
    "inspect_file",
    "judge",
    "judge_ratios",
    "misfits",
]
