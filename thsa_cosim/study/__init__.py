"""A study: what was asked, where it is kept, where it runs, and what is known so far.

``study``     the one who works in a study folder: every simulation goes through it
``place``     folder, executor, progress and command as one object
``identity``  what was asked, key by key, built from all that a scenario says
``folder``    the study folder: its marker, and the refusal to mix two studies
``runs``      the log of runs: what was simulated once is not simulated again
``digest``    files, folders and recordings as digests
``exported``  FMUs that are kept in the folder, and what they were made from
"""

from thsa_cosim.study.digest import digest_of_folder, digest_of_recording, digest_of_text
from thsa_cosim.study.exported import export_digest, is_made_from, note_made_from
from thsa_cosim.study.folder import MARKER, claim_folder, describe
from thsa_cosim.study.identity import stages_identity, study_identity
from thsa_cosim.study.place import OnProgress, Place, Progress
from thsa_cosim.study.study import Study

__all__ = [
    "MARKER",
    "OnProgress",
    "Place",
    "Progress",
    "Study",
    "claim_folder",
    "describe",
    "digest_of_folder",
    "digest_of_recording",
    "digest_of_text",
    "export_digest",
    "is_made_from",
    "note_made_from",
    "stages_identity",
    "study_identity",
]
