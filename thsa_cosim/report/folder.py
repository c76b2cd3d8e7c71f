"""What a study folder holds, finished or not: results, journals, signals, and what was asked."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from thsa_cosim.batch import JournalTable, read_journal
from thsa_cosim.errors import InputError
from thsa_cosim.report.files import RESULT

MARKER, JOURNAL = "study.json", "journal.csv"

Json = Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Part:
    """A study, or one stage of a study in stages: ``result`` is None while it runs, ``journal`` if it has none.

    ``asked`` is the study's identity, key by key, ``about`` what a reader of it wants to know (``study.describe``);
    ``name`` is empty for a whole study.
    """

    name: str
    kind: str
    folder: Path
    result: Json | None
    about: Json
    journal: JournalTable | None
    asked: Json = field(default_factory=dict)

    @property
    def title(self) -> str:
        """The scenario's title, else the stage's or folder's name."""
        found = (self.result or {}).get("title") or self.about.get("title") or self.name
        return str(found or self.folder.resolve().name)

    @property
    def fmu(self) -> Json:
        """``path`` and ``sha256`` of the FMU that was run, as far as they are known."""
        result = self.result or {}
        # A diagnosis calls the one with what it found "fmu".
        found = result.get("declared_fmu") or result.get("fmu")
        return found if isinstance(found, dict) else {"path": self.about.get("fmu")}

    @property
    def prefix(self) -> str:
        """What makes the names of this part's sections and figures unique on the page."""
        return re.sub(r"\W+", "-", self.name) + "-" if self.name else ""

    @property
    def running(self) -> bool:
        """Whether a process is writing the journal at this moment."""
        return self.journal is not None and self.journal.in_use

    @property
    def generations(self) -> int | None:
        """Generations that the search may use at most."""
        return self._search("generations")

    @property
    def population(self) -> int | None:
        """Vectors of a generation."""
        return self._search("population")

    @property
    def searches_locally(self) -> bool:
        """Whether local searches come first."""
        return self._setting("method") == "local-first"

    def _search(self, key: str) -> int | None:
        value = self._setting(key)
        return value if isinstance(value, int) else None

    def _setting(self, key: str) -> object:
        return (self.result or {}).get("settings", {}).get(key, self.about.get(key))


@dataclass(frozen=True, eq=False)
class Study:
    """A study folder: ``whole`` is all of it, ``parts`` its stages (or itself alone)."""

    whole: Part
    parts: tuple[Part, ...]

    @property
    def in_stages(self) -> bool:
        """Whether the study has stages."""
        return self.parts[0] is not self.whole

    @property
    def status(self) -> str:
        """``complete``, ``interrupted``, ``running``, ``stopped`` (no process goes on with it), or ``unfinished``.

        The last is a study of which no journal tells whether it runs.
        """
        parts = (self.whole, *self.parts)
        if any(part.running for part in parts):
            return "running"
        if self.whole.result is not None:
            return str(self.whole.result.get("status", "complete"))
        return "stopped" if any(part.journal is not None for part in parts) else "unfinished"


def read_study(folder: Path) -> Study:
    """Read what ``folder`` holds.

    Raises
    ------
    InputError
        If it is no study folder, or a file in it is damaged.
    """
    if not folder.is_dir():
        raise InputError(
            f"{folder} is no folder; give the folder of a study, such as studies/motor-2026-01-31."
        )
    marker, result = _json(folder / MARKER), _json(folder / RESULT)
    if marker is None and result is None:
        inside = sorted(p.parent.name for p in folder.glob(f"*/{MARKER}"))
        hint = f" Did you mean {str(folder / inside[-1])!r}?" if inside else ""
        raise InputError(f"{folder} is no study folder: it has neither {MARKER} nor {RESULT}.{hint}")
    kind = str((result or {}).get("kind") or (marker or {}).get("kind"))
    whole = _part("", kind.removesuffix(" in stages"), folder, result, marker)
    if "stages" in (result or {}) or kind.endswith(" in stages"):
        return Study(whole, tuple(_stages(folder, result, whole.about)) or (whole,))
    return Study(whole, (whole,))


def _stages(folder: Path, result: Json | None, about: Json) -> list[Part]:
    """The stages that have begun, in order; results come from the merged file if it is there."""
    merged: Json = (result or {}).get("stages", {})
    order = [*about.get("stages", []), *merged]
    parts = []
    for name in dict.fromkeys(str(n) for n in order):
        place = next(
            (p for p in sorted(folder.glob("*_*")) if re.fullmatch(rf"\d+_{re.escape(name)}", p.name)), None
        )
        if place is None:
            continue
        marker = _json(place / MARKER)
        own = merged.get(name) or _json(place / RESULT)
        kind = str((own or marker or {}).get("kind", "identify"))
        parts.append(_part(name, kind, place, own, marker))
    return parts


def _part(name: str, kind: str, folder: Path, result: Json | None, marker: Json | None) -> Part:
    journal = folder / JOURNAL
    about = (marker or {}).get("about", {})
    table = read_journal(journal) if journal.is_file() else None
    asked = (marker or {}).get("asked", {})
    return Part(
        name,
        kind,
        folder,
        result,
        about if isinstance(about, dict) else {},
        table,
        asked if isinstance(asked, dict) else {},
    )


def _json(path: Path) -> Json | None:
    """The object in a JSON file; None where there is no file."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (ValueError, RecursionError):
        raise InputError(
            f"{path} is damaged: it is no JSON; repeat the study's command to write it anew."
        ) from None
    if not isinstance(found, dict):
        raise InputError(
            f"{path} is damaged: it holds no object; repeat the study's command to write it anew."
        )
    return found
