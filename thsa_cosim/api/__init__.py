"""For notebooks and scripts: run a scenario or open a study folder, get tables (pandas) and figures (matplotlib).

``before``   a first scenario; what its recordings will determine
``run``      identify, tune, diagnose, simulate: a scenario in, a study out
``conduct``  the table of kinds, and how a study of any of them is conducted (the command line does it so, too)
``study``    what every study folder says; ``kinds``: what each kind says besides
``several``  the studies of a folder, and what differs between some of them

``import thsa_cosim as tc`` offers all of it as ``tc.identify(...)`` and so on. A study is read from its folder, so
that one that was run elsewhere opens as one that has just been run.
"""

from thsa_cosim.api.before import init, sensitivity
from thsa_cosim.api.conduct import cores, default_folder
from thsa_cosim.api.kinds import DiagnoseStudy, IdentifyStudy, SimulateStudy, TuneStudy, open_study
from thsa_cosim.api.run import diagnose, identify, simulate, tune
from thsa_cosim.api.several import compare, list_studies
from thsa_cosim.api.study import Study

__all__ = [
    "DiagnoseStudy",
    "IdentifyStudy",
    "SimulateStudy",
    "Study",
    "TuneStudy",
    "compare",
    "cores",
    "default_folder",
    "diagnose",
    "identify",
    "init",
    "list_studies",
    "open_study",
    "sensitivity",
    "simulate",
    "tune",
]
