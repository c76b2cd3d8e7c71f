"""The study folder: what makes two runs the same study, and the refusal to mix different ones."""

import json
from collections.abc import Mapping
from pathlib import Path

from thsa_cosim.errors import InputError

MARKER = "study.json"

_WORDS = {
    "kind": "another kind of study",
    "scenario": "a study of another scenario",
    "fmu": "a study of another FMU",
    "recordings": "a study of other recordings",
    "seed": "a study with another seed",
}


def open_study(folder: Path, identity: Mapping[str, object]) -> bool:
    """Create ``folder``, or check that it holds the same study; True if it is continued.

    ``identity`` maps the keys kind, scenario, fmu, recordings and seed to JSON values (digests, numbers).
    Raises InputError when the folder belongs to another study, holds something else, or cannot be written.
    """
    marker = folder / MARKER
    wanted = json.loads(json.dumps(dict(identity)))
    try:
        if marker.exists():
            return _check(folder, marker, wanted)
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InputError(f"{folder} exists and is no study folder; choose an empty or new one with -o.")
        folder.mkdir(parents=True, exist_ok=True)
        partial = marker.with_name(MARKER + ".part")
        partial.write_text(json.dumps(wanted, indent=2) + "\n", encoding="utf-8")
        partial.replace(marker)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise InputError(
            f"The study folder {folder} cannot be used ({reason}); choose another with -o."
        ) from None
    return False


def _check(folder: Path, marker: Path, wanted: Mapping[str, object]) -> bool:
    try:
        found = json.loads(marker.read_text(encoding="utf-8"))
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise InputError(f"{marker} is damaged; choose another study folder with -o.")
    for key, value in wanted.items():
        if found.get(key) != value:
            what = _WORDS.get(key, f"a study with another {key}")
            raise InputError(
                f"{folder} holds {what}; choose another folder with -o, or repeat that study's command."
            )
    return True
