"""The study folder: its marker says what was asked, and two studies are never mixed in one."""

import datetime
import json
import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from thsa_cosim import __version__
from thsa_cosim.errors import InputError
from thsa_cosim.scenario import Scenario, TuneScenario

MARKER = "study.json"
#: Packages that a reader of a study may want to know the version of.
_PACKAGES = ("fmpy", "numba", "numpy", "pandas", "pint", "scipy")
#: Longer values are cut in a sentence; of a digest so much tells two apart.
_LONG, _DIGEST = 60, 12


def describe(scenario: Scenario | TuneScenario) -> dict[str, object]:
    """What a reader of an unfinished study wants to know: what was asked, where from, with which search."""
    return {
        "title": scenario.title or scenario.path.stem,
        "scenario": str(scenario.path),
        "fmu": str(scenario.fmu.path),
        "method": scenario.search.method,
        "population": scenario.search.population,
        "generations": scenario.search.generations,
        "parameters": {p.name: p.unit for p in scenario.parameters.parameters},
    }


def claim_folder(
    folder: Path, identity: Mapping[str, object], about: Mapping[str, object] | None = None
) -> bool:
    """Create ``folder``, or check that it holds the same study; True if it is continued.

    ``identity`` maps keys to plain JSON values; its ``kind`` is one of them. ``about`` is kept next to it for readers,
    as it was last given, and takes no part in the comparison. Raises InputError when the folder belongs to another
    study (the sentence names a key and both values), holds something else, or cannot be written.
    """
    marker = folder / MARKER
    asked = json.loads(json.dumps(dict(identity)))
    try:
        if marker.exists():
            found = _same(folder, marker, asked)
            known = found.get("about")
            kept = known if isinstance(known, dict) else {}
            fresh = {**kept, **json.loads(json.dumps(about or {}))}
            if fresh != known:
                _write(marker, asked, fresh)
            return True
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InputError(f"{folder} exists and is no study folder; choose an empty or new one with -o.")
        folder.mkdir(parents=True, exist_ok=True)
        _write(marker, asked, {**(about or {}), **_origin()})
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise InputError(
            f"The study folder {folder} cannot be used ({reason}); choose another with -o."
        ) from None
    return False


def _write(marker: Path, asked: Mapping[str, object], about: Mapping[str, object]) -> None:
    content = {"kind": asked.get("kind"), "asked": asked, "about": about}
    partial = marker.with_name(MARKER + ".part")
    partial.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    partial.replace(marker)


def _same(folder: Path, marker: Path, asked: Mapping[str, Any]) -> dict[str, Any]:
    """The marker's content; InputError if it is damaged, or something else was asked."""
    try:
        found = json.loads(marker.read_text(encoding="utf-8"))
    except ValueError:
        found = None
    if not isinstance(found, dict) or not found:
        raise InputError(f"{marker} is damaged; choose another study folder with -o.")
    before = found.get("asked")
    if not isinstance(before, dict):
        raise InputError(
            f"{folder} holds a study of an older version of thsa-cosim; choose another folder with -o."
        )
    if keys := changed(before, asked):
        key = keys[0]
        more = "" if len(keys) == 1 else f" (and {len(keys) - 1} more)"
        raise InputError(
            f"{folder} holds a study with {key} {_shown(before.get(key))};"
            f" this one has {key} {_shown(asked.get(key))}{more}:"
            " choose another folder with -o, or change it back."
        )
    return found


def changed(before: Mapping[str, Any], asked: Mapping[str, Any]) -> list[str]:
    """Keys whose values differ, the kind first, and mere orders and the start values that follow from others last."""

    def rank(key: str) -> int:
        follows = key.startswith("start values") or key.endswith("(order)")
        return 0 if key == "kind" else 2 if follows else 1

    keys = [key for key in dict.fromkeys((*asked, *before)) if before.get(key) != asked.get(key)]
    return sorted(keys, key=rank)


def _shown(value: Any) -> str:
    if value is None:
        return "not given"
    if isinstance(value, str) and len(value) == 64 and all(c in "0123456789abcdef" for c in value):
        return f"sha256 {value[:_DIGEST]}"
    text = json.dumps(value, ensure_ascii=False)
    return "= " + (text if len(text) <= _LONG else f"{text[: _LONG - 1]}…")


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
