"""A study: what was asked, where it is kept, where it runs, and what is known so far.

``study``       the one who works in a study folder: every simulation goes through it
``case``        a recording as a simulation that a model has to match
``engine``      vectors × cases → journal → outcomes: every kind asks it
``interleave``  several searches at once over one engine
``comparison``  simulated against measured
``coupling``    what the communication steps of a system cost
``place``       folder, executor, progress and command as one object
``identity``    what was asked, key by key, built from all that a scenario says
``folder``      the study folder: its marker, and the refusal to mix two studies
``runs``        the log of runs: what was simulated once is not simulated again
``digest``      files, folders and recordings as digests
``exported``    FMUs that are kept in the folder, and what they were made from
"""

from thsa_cosim.study.case import Case, build_case, communication_points
from thsa_cosim.study.comparison import (
    ChannelError,
    Comparison,
    case_residuals,
    compare,
    compare_case,
    reached,
    summarise,
)
from thsa_cosim.study.coupling import CouplingError, coupling_error
from thsa_cosim.study.digest import digest_of_file, digest_of_folder, digest_of_recording, digest_of_text
from thsa_cosim.study.engine import Engine, Problem, Reply, Request, Want, stacked
from thsa_cosim.study.exported import export_digest, is_made_from, keep, note_made_from, take_kept
from thsa_cosim.study.folder import MARKER, claim_folder, describe
from thsa_cosim.study.identity import shown_words, stages_identity, study_identity
from thsa_cosim.study.interleave import interleave
from thsa_cosim.study.place import OnProgress, Place, Progress
from thsa_cosim.study.study import Study

__all__ = [
    "MARKER",
    "Case",
    "ChannelError",
    "Comparison",
    "CouplingError",
    "Engine",
    "OnProgress",
    "Place",
    "Problem",
    "Progress",
    "Reply",
    "Request",
    "Study",
    "Want",
    "build_case",
    "case_residuals",
    "claim_folder",
    "communication_points",
    "compare",
    "compare_case",
    "coupling_error",
    "describe",
    "digest_of_file",
    "digest_of_folder",
    "digest_of_recording",
    "digest_of_text",
    "export_digest",
    "interleave",
    "is_made_from",
    "keep",
    "note_made_from",
    "reached",
    "shown_words",
    "stacked",
    "stages_identity",
    "study_identity",
    "summarise",
    "take_kept",
]
