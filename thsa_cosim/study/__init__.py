"""A study: what was asked, where it is kept.

``identity``  what was asked, key by key, built from all that a scenario says
``folder``    the study folder: its marker, and the refusal to mix two studies
``digest``    files, folders and recordings as digests
``exported``  FMUs that are kept in the folder, and what they were made from
"""

from thsa_cosim.study.digest import digest_of_folder, digest_of_recording, digest_of_text
from thsa_cosim.study.exported import export_digest, is_made_from, note_made_from
from thsa_cosim.study.folder import MARKER, describe, open_study
from thsa_cosim.study.identity import stages_identity, study_identity

__all__ = [
    "MARKER",
    "describe",
    "digest_of_folder",
    "digest_of_recording",
    "digest_of_text",
    "export_digest",
    "is_made_from",
    "note_made_from",
    "open_study",
    "stages_identity",
    "study_identity",
]
