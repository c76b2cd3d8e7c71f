"""A recording's file on its own, without a scenario: which columns it holds, and what is wrong with them."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from thsa_cosim.inspection.finding import Inspection
from thsa_cosim.recordings.columns import FoundColumn, find_columns, time_column


@dataclass(frozen=True)
class FileReport:
    """What a file holds; ``time`` names its time column, None where channels carry their own time."""

    path: Path
    sha256: str
    columns: tuple[FoundColumn, ...]
    time: str | None
    data: Inspection

    def to_dict(self) -> dict[str, Any]:
        """Return the report as JSON types."""
        return {
            "kind": "recording",
            "path": str(self.path),
            "sha256": self.sha256,
            "time": self.time,
            "columns": [{"name": c.name, "unit": c.unit, "noise": c.noise} for c in self.columns],
            "data": self.data.to_dict(),
            "verdict": {"good": "ok", "usable": "warning", "bad": "failed"}[self.data.verdict],
        }


def inspect_file(path: Path) -> FileReport:
    """Inspect a recording's file; RecordingError if it cannot be read or holds no numbers."""
    columns = find_columns(path)
    time = time_column(columns)
    return FileReport(
        path=path,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        columns=columns,
        time=None if time is None else time.name,
        data=Inspection(),
    )
