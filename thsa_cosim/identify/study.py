"""The study folder: what makes two runs the same study, and the refusal to mix different ones."""

import datetime
import json
import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from thsa_cosim import __version__
from thsa_cosim.errors import InputError
from thsa_cosim.scenario import Scenario, TuneScenario

MARKER = "study.json"

_WORDS = {
    "kind": "another kind of study",
    "scenario": "a study of another scenario",
    "fmu": "a study of another FMU",
    "recordings": "a study of other recordings",
    "seed": "a study with another seed",
}


#: Packages whose version may change a study's numbers.
_PACKAGES = ("fmpy", "numba", "numpy", "pandas", "pint", "scipy")


def describe(scenario: Scenario | TuneScenario, command: str) -> dict[str, object]:
    """What a reader of an unfinished study wants to know: what was asked, where from, with which search.

    ``command``: the command line that repeats it, empty for a study that a script runs.
    """
    return {
        "title": scenario.title or scenario.path.stem,
        "scenario": str(scenario.path),
        "command": command,
        "fmu": str(scenario.fmu.path),
        "method": scenario.search.method,
        "population": scenario.search.population,
        "generations": scenario.search.generations,
        "parameters": {p.name: p.unit for p in scenario.parameters.parameters},
    }


def _origin() -> dict[str, object]:
    """When, where and with what a study began."""
    versions = {"thsa-cosim": __version__, "Python": platform.python_version()}
    for package in _PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:  # a stripped installation; the study itself does not need to know
            continue
    return {
        "started": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "directory": str(Path.cwd()),
        "system": platform.platform(),
        "versions": versions,
    }


def open_study(
    folder: Path, identity: Mapping[str, object], about: Mapping[str, object] | None = None
) -> bool:
    """Create ``folder``, or check that it holds the same study; True if it is continued.

    ``identity`` maps the keys kind, scenario, fmu, recordings and seed to JSON values (digests, numbers).
    ``about`` is kept beside it for readers and takes no part in the comparison.
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
        content = {**wanted, "about": {**(about or {}), **_origin()}}
        partial = marker.with_name(MARKER + ".part")
        partial.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
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
