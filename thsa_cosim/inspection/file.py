"""A recording's file on its own, without a scenario: which columns it holds, and what is wrong with them."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.errors import UnitError
from thsa_cosim.inspection.channel import Channel
from thsa_cosim.inspection.finding import Finding, Inspection
from thsa_cosim.inspection.recording import inspect_channels
from thsa_cosim.inspection.time_axis import time_findings
from thsa_cosim.recordings import load_columns
from thsa_cosim.recordings.columns import TIME_NAMES, FoundColumn, find_columns, time_column
from thsa_cosim.recordings.table import RawColumn
from thsa_cosim.signals import FloatArray
from thsa_cosim.units import convert


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
    raw = load_columns(path)
    columns = find_columns(path)
    time = time_column(columns)
    findings = [*_blank(path, raw), *_ignored(path, raw, columns)]
    if time is not None or any(c.own_time for c in columns):
        findings += _of_channels(path, raw, columns, time)
    else:
        findings += _no_time(path, raw, columns)
    return FileReport(
        path=path,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        columns=columns,
        time=None if time is None else time.name,
        data=Inspection.of(findings),
    )


def _no_time(path: Path, raw: Mapping[str, RawColumn], columns: tuple[FoundColumn, ...]) -> list[Finding]:
    """What keeps a column that is called time from being one."""
    named = next((c for c in columns if TIME_NAMES & {word.lower() for word in c.words}), None)
    found = []
    if named is not None:
        found = list(time_findings(path.stem, _seconds(raw[named.name].values, named.unit)))
    if any(f.kind == "repeated-stamps" for f in found):
        return found
    text = "no column increases as a time axis does; name it, or repair its stamps"
    return [Finding(path.stem, "time", "repeated-stamps", "warning", text)]


def _of_channels(
    path: Path, raw: Mapping[str, RawColumn], columns: tuple[FoundColumn, ...], time: FoundColumn | None
) -> list[Finding]:
    channels: list[Channel] = []
    axes: list[FloatArray] = []
    for column in columns:
        if column is time:
            continue
        values = raw[column.name].values
        stamps = _seconds(raw[time.name].values, time.unit) if time is not None else raw[column.name].time
        if stamps is None or stamps.size != values.size:
            continue
        kept = np.isfinite(values) & np.isfinite(stamps)
        if np.sum(kept) < 2:
            continue
        if not any(np.array_equal(stamps, axis) for axis in axes):
            axes.append(stamps)
        rising = np.concatenate(([True], np.diff(stamps[kept]) > 0.0))
        channel = Channel(
            recording=path.stem,
            name=column.name,
            unit=column.unit or "1",
            role="other",
            time=stamps[kept][rising],
            values=values[kept][rising],
        )
        # Nobody says here what drives the model; a schedule can only be a command.
        channels.append(replace(channel, role="input") if channel.drawn else channel)
    return list(inspect_channels(path.stem, channels, axes))


def _seconds(values: FloatArray, unit: str | None) -> FloatArray:
    try:
        return np.asarray(convert(values, unit or "s", "s"))
    except UnitError:
        return values


def _blank(path: Path, raw: Mapping[str, RawColumn]) -> list[Finding]:
    """Columns of numbers with cells that hold none."""
    found = []
    for name, column in raw.items():
        if column.problem or not column.values.size:
            continue
        missing = int(np.sum(~np.isfinite(column.values)))
        if 0 < missing < column.values.size:
            text = f"{missing} of {column.values.size} cells hold no number"
            remedy = "missing = []  # under the signal's [recordings.columns]: such samples are left out"
            found.append(Finding(path.stem, name, "dropouts", "warning", text, (), remedy))
    return found


def _ignored(path: Path, raw: Mapping[str, RawColumn], columns: tuple[FoundColumn, ...]) -> list[Finding]:
    """Columns that cannot be used as numbers."""
    known = {c.name for c in columns}
    return [
        Finding(path.stem, name, "no-numbers", "note", f"the column {column.problem or 'holds no numbers'}")
        for name, column in raw.items()
        if name not in known and (column.problem or not np.isfinite(column.values).any())
    ]
