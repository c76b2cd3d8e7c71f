"""The studies of a folder: what each is, how far it is, and what came out, in a line."""

import datetime
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from thsa_cosim.errors import InputError, did_you_mean_path
from thsa_cosim.report.files import RESULT
from thsa_cosim.report.folder import MARKER, Json, Study, read_study
from thsa_cosim.report.parts.text import count, number

DEEPEST = 4
"""Folders below the one that is listed, at most."""


@dataclass(frozen=True)
class Entry:
    """A study in a line; ``started`` is UTC in ISO 8601, ``problem`` why its folder cannot be read."""

    folder: Path
    kind: str = ""
    status: str = ""
    started: str = ""
    scenario: str = ""
    title: str = ""
    outcome: str = ""
    problem: str = ""


def list_studies(folder: Path) -> list[Entry]:
    """Return the studies in ``folder`` and below, the latest first; stages belong to their study.

    A folder that cannot be read is listed with its problem. InputError if ``folder`` is none.
    """
    if not folder.is_dir():
        raise InputError(
            f"There is no folder {folder}; give one that holds studies.{did_you_mean_path(folder)}"
        )
    return sorted(
        (_entry(place) for place in _places(folder, DEEPEST)), key=lambda e: e.started, reverse=True
    )


def _places(folder: Path, deep: int) -> Iterator[Path]:
    if (folder / MARKER).is_file() or (folder / RESULT).is_file():
        yield folder
        return
    if deep == 0:
        return
    try:
        inside = sorted(p for p in folder.iterdir() if p.is_dir() and not p.name.startswith("."))
    except OSError:
        return
    for place in inside:
        yield from _places(place, deep - 1)


def _entry(folder: Path) -> Entry:
    try:
        study = read_study(folder)
        return Entry(
            folder,
            study.whole.kind,
            study.status,
            _started(study),
            _scenario(study),
            study.whole.title,
            outcome(study),
        )
    except InputError as error:
        return Entry(folder, status="damaged", problem=str(error))
    except (KeyError, TypeError, ValueError, AttributeError, IndexError):
        return Entry(folder, status="damaged", problem=f"{folder / RESULT} is no result of this version.")


def _started(study: Study) -> str:
    """When the study began, as it says, else when its newest file was written."""
    if study.whole.about.get("started"):
        return str(study.whole.about["started"])
    files = [p for p in (study.whole.folder / RESULT, study.whole.folder / MARKER) if p.is_file()]
    newest = max(p.stat().st_mtime for p in files)
    return datetime.datetime.fromtimestamp(newest, datetime.UTC).isoformat(timespec="seconds")


def _scenario(study: Study) -> str:
    found = (study.whole.result or {}).get("scenario") or study.whole.about.get("scenario") or ""
    return str(found).replace("\\", "/").rsplit("/", 1)[-1]


def outcome(study: Study) -> str:
    """What came out, in a few words: the verdict, the cost, or how far the search is."""
    result = study.whole.result
    if result is None:
        done = sum(len(part.journal.rows) for part in study.parts if part.journal is not None)
        return f"{count(done, 'vector')} evaluated" if done else "nothing yet"
    kind = study.whole.kind
    if kind == "diagnose":
        names = ", ".join(str(e["name"]) for e in result.get("effects", []))
        return str(result["verdict"]) + (f": {names}" if names else "")
    if kind == "tune":
        after, before = result.get("after"), result.get("before")
        if not after:
            return "no gains"
        was = f"{number((before or {}).get('cost'), 3)} → " if before else ""
        return f"cost {was}{number(after['cost'], 3)}" + ("" if result.get("feasible") else ", infeasible")
    return _worst(result)


def _worst(result: Json) -> str:
    """The largest error over all signals, in units of the noise."""
    errors = [e for channels in result.get("error", {}).values() for e in channels.values()]
    errors += [e for r in result.get("recordings", []) for e in r["error"].values()]
    ratios = [e["rmse"] / e["noise"] for e in errors if e.get("noise")]
    return f"worst error {number(max(ratios), 3)} × noise" if ratios else "not compared"
