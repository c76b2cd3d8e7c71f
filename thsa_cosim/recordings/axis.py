"""The time axis of a recording: read, checked, cut, resampled; and the units and samples it must have."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from thsa_cosim.errors import RecordingError, UnitError
from thsa_cosim.recordings.table import RawColumn
from thsa_cosim.signals import FloatArray
from thsa_cosim.units import conversion, convert, same_dimension

_ABSURD = 1e100
"""Above this nothing is measured, and squares overflow."""


@dataclass(frozen=True)
class TimeAxis:
    """How time is read, cut and resampled.

    ``column`` None takes the file's own time axis (TDMS waveforms, MF4). ``start`` and ``stop`` [s] cut in the
    file's time; the cut begins ``lead_in`` s earlier as far as the file goes. The first kept sample becomes time 0
    if ``from_zero``. ``step`` [s] resamples linearly. ``repeated``: what becomes of rows whose stamp repeats or goes
    back.
    """

    column: str | None = None
    unit: str | None = None
    start: float | None = None
    stop: float | None = None
    step: float | None = None
    from_zero: bool = True
    lead_in: float = 0.0
    repeated: Literal["refuse", "drop"] = "refuse"


def without_repeats(raw: Mapping[str, RawColumn], axis: TimeAxis) -> tuple[dict[str, RawColumn], int]:
    """Return the columns without the rows whose stamp does not lie after all before, and how many those were."""
    stamps = raw[axis.column].values if axis.column is not None else np.empty(0)
    if axis.repeated == "refuse" or stamps.size == 0:
        return dict(raw), 0
    latest = np.maximum.accumulate(np.where(np.isfinite(stamps), stamps, -np.inf))
    kept = np.concatenate(([True], stamps[1:] > latest[:-1]))
    same = {n: c for n, c in raw.items() if c.values.size == stamps.size}
    dropped = {n: replace(c, values=c.values[kept]) for n, c in same.items()}
    return {**raw, **dropped}, int(np.sum(~kept))


def times(path: Path, asked: str, raw: Mapping[str, RawColumn], axis: TimeAxis) -> FloatArray:
    """Return the (n,) times [s] of column ``asked``: finite and increasing."""
    column = raw[asked]
    if axis.column is None:
        if column.time is None:
            raise RecordingError(
                f"{path}: column {asked!r} has no time of its own; name the time column (recordings.time.column)."
            )
        numbers, unit, label = column.time, "s", f"time of {asked!r}"
    else:
        raw_time = raw[axis.column]
        label = f"time column {axis.column!r}"
        unit = source_unit(path, axis.column, axis.unit, raw_time.unit, "recordings.time")
        numbers = raw_time.values
        if numbers.size != column.values.size:
            raise RecordingError(
                f"{path}: column {asked!r} has {column.values.size} samples, but {label} has {numbers.size};"
                f" leave recordings.time.column out to use each channel's own time."
            )
    try:
        seconds = convert(numbers, unit, "s")
    except UnitError as error:
        raise UnitError(f"{path}: {label}: {error}") from None
    if seconds.size < 2:
        raise RecordingError(f"{path}: holds {seconds.size} samples of {asked!r}; at least 2 are needed.")
    bad = np.flatnonzero(~np.isfinite(seconds))
    if bad.size:
        raise RecordingError(f"{path}: {label} is {seconds[bad[0]]} at sample {bad[0] + 1}; remove the row.")
    back = np.flatnonzero(np.diff(seconds) <= 0)
    if back.size:
        k = int(back[0])
        raise RecordingError(
            f"{path}: {label} does not increase at sample {k + 2} ({seconds[k + 1]:g} s after {seconds[k]:g} s);"
            f' sort the rows, or drop repeated ones with recordings.time.repeated = "drop".'
        )
    return seconds


def common_grid(path: Path, own: Mapping[str, FloatArray], axis: TimeAxis) -> FloatArray:
    """Return the common time axis [s]: the finest one, over the span that all columns share, cut and resampled."""
    if not own:
        raise RecordingError(f"{path}: no column is read from it; name at least one.")
    finest = min(own.values(), key=lambda t: (t[-1] - t[0]) / t.size)
    low = max(float(t[0]) for t in own.values())
    high = min(float(t[-1]) for t in own.values())
    low = low if axis.start is None else max(low, axis.start - axis.lead_in)
    high = high if axis.stop is None else min(high, axis.stop)
    grid = finest[(finest >= low) & (finest <= high)]
    if grid.size < 2:
        raise RecordingError(
            f"{path}: {grid.size} samples lie between {low:g} s and {high:g} s, at least 2 are needed;"
            f" the file runs from {finest[0]:g} s to {finest[-1]:g} s."
        )
    if axis.step is None:
        return grid
    span = float(grid[-1] - grid[0])
    count = int(span / max(axis.step, 1e-9 * span) * (1 + 1e-12)) + 1
    if not 2 <= count <= 100_000_000:
        raise RecordingError(
            f"{path}: a step of {axis.step:g} s does not fit a recording of {grid[-1] - grid[0]:g} s."
        )
    resampled: FloatArray = np.minimum(grid[0] + axis.step * np.arange(count), grid[-1])
    return resampled


def check_finite(path: Path, asked: str, values: FloatArray, time: FloatArray, kept: object) -> None:
    """Raise RecordingError if a (n,) value is not finite where the (n,) mask ``kept`` holds."""
    bad = np.flatnonzero(~np.isfinite(values) & np.asarray(kept))
    if bad.size:
        k = int(bad[0])
        raise RecordingError(
            f"{path}: column {asked!r} is {values[k]} at {time[k]:g} s (sample {k + 1}, {bad.size} in all);"
            f" repair the file or cut it with recordings.time.start and .stop."
        )
    absurd = np.flatnonzero((np.abs(values) > _ABSURD) & np.asarray(kept) & np.isfinite(values))
    if absurd.size:
        k = int(absurd[0])
        raise RecordingError(
            f"{path}: column {asked!r} is {values[k]:g} at {time[k]:g} s (sample {k + 1}, {absurd.size} in all), which"
            f" nothing measures; if it means that there is no value, list it as missing in recordings.columns."
        )


def _open_speed(unit: str) -> bool:
    """Whether a unit is one per time that does not say what it counts."""
    return same_dimension(unit, "Hz") and not same_dimension(unit, "rad/s")


def source_unit(path: Path, asked: str, given: str | None, stated: str | None, key: str) -> str:
    """Return the unit of the file's numbers: the scenario's, else the file's; they may not differ."""
    if given is None:
        if stated is None:
            raise UnitError(f'{path}: column {asked!r} states no unit; add unit = "..." under {key}.')
        try:
            conversion(stated, stated)
        except UnitError as error:
            raise UnitError(f"{path}: column {asked!r}: {error}") from None
        return stated
    try:
        conversion(given, given)
    except UnitError as error:
        raise UnitError(f"{path}: unit of column {asked!r} ({key}.unit): {error}") from None
    if stated is None:
        return given
    try:
        same = np.allclose(conversion(given, stated), (1.0, 0.0), rtol=1e-9, atol=1e-12)
    except UnitError:
        try:
            conversion(stated, stated)
        except UnitError:
            return given  # the file's unit is no unit ("counts/div"): the scenario knows better
        # Turns or radians: the file does not say ("Hz", "1/s"), the scenario does.
        same = _open_speed(stated) and same_dimension(given, "rad/s")
    if not same:
        raise UnitError(
            f"{path}: column {asked!r} is in {stated!r} by the file, but {key}.unit says {given!r};"
            f" correct one of them."
        )
    return given
