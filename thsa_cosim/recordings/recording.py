"""A recording: measured signals in the FMU's names and units, checked once, here."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Literal

import numpy as np

from thsa_cosim.errors import RecordingError, ThsaCosimError, UnitError, did_you_mean
from thsa_cosim.recordings.noise import noise_estimate
from thsa_cosim.recordings.table import Choose, RawColumn, resolve
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.units import conversion, convert

SUFFIXES: Mapping[str, str] = {
    **dict.fromkeys((".csv", ".txt", ".tsv", ".dat", ".asc", ".lvm"), "csv"),
    **dict.fromkeys((".parquet", ".pq"), "parquet"),
    **dict.fromkeys((".mf4", ".mdf"), "mf4"),
    ".mat": "mat",
    ".tdms": "tdms",
}
"""Reader module per file name ending."""


@dataclass(frozen=True)
class Column:
    """Where one signal comes from: a column of the file, or a constant.

    Parameters
    ----------
    column
        Name in the file, in full or without its unit or group; None with ``value``.
    unit
        Unit in the file; None takes the one that the file states.
    value
        A constant [unit] instead of a column.
    scale, offset
        Applied to the file's numbers first: ``scale * x + offset`` (a sign flip is ``scale = -1``).
    shift
        s; the signal is moved to later times by this much (negative: a sensor lag is taken out).
    smooth
        ``"mean"`` replaces the signal by its mean.
    interpolation
        ``"linear"`` between samples, or ``"hold"``: the value stays until the next sample, as a digital
        command does.
    """

    column: str | None = None
    unit: str | None = None
    value: float | None = None
    scale: float = 1.0
    offset: float = 0.0
    shift: float = 0.0
    smooth: Literal["none", "mean"] = "none"
    interpolation: Literal["linear", "hold"] = "linear"


@dataclass(frozen=True)
class TimeAxis:
    """How time is read, cut and resampled.

    ``column`` None takes the file's own time axis (TDMS waveforms, MF4). ``start`` and ``stop`` [s] cut in the
    file's time; the first kept sample becomes time 0 if ``from_zero``. ``step`` [s] resamples linearly.
    """

    column: str | None = None
    unit: str | None = None
    start: float | None = None
    stop: float | None = None
    step: float | None = None
    from_zero: bool = True


@dataclass(frozen=True, eq=False)
class Recording:
    """Measured signals under the FMU's variable names, in its units."""

    name: str
    path: Path
    sha256: str
    signals: Signals
    temperature_degC: float | None = None
    noise: Mapping[str, float] = field(default_factory=dict)
    """Estimated standard deviation of the white noise, in the FMU's unit; 0 where none can be seen."""

    @property
    def duration(self) -> float:
        """Length in s."""
        return float(self.signals.time[-1] - self.signals.time[0])


def column_names(path: Path | str) -> tuple[str, ...]:
    """Return the names of a file's columns; RecordingError as :func:`read_recording`."""
    names: list[str] = []

    def note(found: Sequence[str]) -> Sequence[str]:
        names.extend(found)
        return ()

    _load(Path(path), note)
    return tuple(names)


def read_recording(
    path: Path | str,
    columns: Mapping[str, Column],
    *,
    time: TimeAxis | None = None,
    units: Mapping[str, str | None] | None = None,
    temperature: str | Column | None = None,
    name: str | None = None,
) -> Recording:
    """Read a measured file into signals named and scaled as the FMU wants them.

    Parameters
    ----------
    columns
        Source of each signal, by FMU variable name.
    units
        Unit of each FMU variable; a name without unit (or None) takes the file's numbers as they are.
    temperature
        Which signal, or which column besides, gives the recording its temperature (its mean, in degC).
    name
        Name in results; default the file's name without ending.

    Raises
    ------
    RecordingError
        If the file is missing, unreadable or empty, a column is unknown, not numeric or not finite, or time
        does not increase.
    UnitError
        If a unit is unknown, missing, or contradicts the file or the FMU.
    MissingExtraError
        If the format needs an optional dependency.
    """
    path, axis = Path(path), time or TimeAxis()
    sources = dict(columns)
    if isinstance(temperature, Column):
        sources[_TEMPERATURE] = temperature
    raw, sha256 = _load_chosen(path, sources, axis)
    targets: dict[str, str | None] = {**(units or {}), _TEMPERATURE: "degC"}
    own = {s.column: _times(path, s.column, raw, axis) for s in sources.values() if s.column is not None}
    grid = _grid(path, own, axis)
    values: dict[str, FloatArray] = {}
    noise: dict[str, float] = {}
    for signal, source in sources.items():
        if source.column is None:
            unit = source.unit or targets.get(signal) or "1"
            constant = _to_unit(
                path, signal, source, unit, targets.get(signal), np.array([source.value or 0.0])
            )
            values[signal], noise[signal] = np.full(grid.shape, constant[0]), 0.0
            continue
        column, t = raw[source.column], own[source.column]
        kept = (t >= grid[0]) & (t <= grid[-1])
        _check_finite(path, source.column, column.values, t, kept)
        numbers = source.scale * column.values + source.offset
        numbers = _to_unit(path, signal, source, column.unit, targets.get(signal), numbers)
        noise[signal] = noise_estimate(numbers[kept])
        if source.smooth == "mean":
            values[signal] = np.full(grid.shape, float(np.mean(numbers[kept])))
        elif source.shift == 0.0 and np.array_equal(t[kept], grid):
            values[signal] = numbers[kept]
        else:
            held = frozenset((signal,)) if source.interpolation == "hold" else frozenset()
            values[signal] = Signals(t, {signal: numbers}, held=held).resample(grid - source.shift)[signal]
    degrees = _temperature(values, temperature, targets)
    values.pop(_TEMPERATURE, None)
    noise.pop(_TEMPERATURE, None)
    held = frozenset(n for n in values if columns[n].interpolation == "hold")
    stamped = grid - grid[0] if axis.from_zero else grid
    signals = Signals(stamped, values, {n: targets.get(n) or columns[n].unit or "1" for n in values}, held)
    return Recording(name or path.stem, path, sha256, signals, degrees, noise)


_TEMPERATURE = "\0temperature"


def _load_chosen(
    path: Path, sources: Mapping[str, Column], axis: TimeAxis
) -> tuple[dict[str, RawColumn], str]:
    """Load the columns that are asked for, under the names by which they are asked for."""
    wanted = [s.column for s in sources.values() if s.column is not None]
    wanted += [axis.column] if axis.column is not None else []
    full: dict[str, str] = {}

    def choose(names: Sequence[str]) -> list[str]:
        full.update({w: resolve(path, names, w) for w in wanted})
        return list(dict.fromkeys(full.values()))

    loaded, sha256 = _load(path, choose)
    for asked, key in full.items():
        if problem := loaded[key].problem:
            raise RecordingError(f"{path}: column {asked!r} {problem}; use a column of numbers.")
    return {asked: loaded[key] for asked, key in full.items()}, sha256


def _load(path: Path, choose: Choose) -> tuple[dict[str, RawColumn], str]:
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        hint = did_you_mean(suffix, SUFFIXES) or f" Known endings: {', '.join(SUFFIXES)}."
        raise RecordingError(f"{path}: file ending {suffix!r} is not a known recording format.{hint}")
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        near = did_you_mean(path.name, _neighbours(path))
        raise RecordingError(f"{path}: no such file; check the path.{near}") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise RecordingError(f"{path}: cannot be read ({reason}).") from None
    if not content:
        raise RecordingError(f"{path}: is empty; record or export it again.")
    read: Callable[[Path, Choose], dict[str, RawColumn]]
    read = import_module(f"thsa_cosim.recordings.{SUFFIXES[suffix]}").read
    try:
        return read(path, choose), hashlib.sha256(content).hexdigest()
    except ThsaCosimError:
        raise
    except Exception as error:  # the parsers raise anything on a damaged file
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise RecordingError(
            f"{path}: is no readable {SUFFIXES[suffix]} file ({reason.rstrip('.')}); export it again."
        ) from None


def _neighbours(path: Path) -> list[str]:
    try:
        return [p.name for p in path.parent.iterdir()]
    except OSError:
        return []


def _times(path: Path, asked: str, raw: Mapping[str, RawColumn], axis: TimeAxis) -> FloatArray:
    """Return the (n,) times [s] of column ``asked``: finite and increasing."""
    column = raw[asked]
    if axis.column is None:
        if column.time is None:
            raise RecordingError(
                f"{path}: column {asked!r} has no time of its own; name the time column (recordings.time.column)."
            )
        times, unit, label = column.time, "s", f"time of {asked!r}"
    else:
        raw_time = raw[axis.column]
        label = f"time column {axis.column!r}"
        unit = _source_unit(path, axis.column, axis.unit, raw_time.unit, "recordings.time")
        times = raw_time.values
        if times.size != column.values.size:
            raise RecordingError(
                f"{path}: column {asked!r} has {column.values.size} samples, but {label} has {times.size};"
                f" leave recordings.time.column out to use each channel's own time."
            )
    try:
        seconds = convert(times, unit, "s")
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
            f" sort the rows and drop repeated ones."
        )
    return seconds


def _grid(path: Path, own: Mapping[str, FloatArray], axis: TimeAxis) -> FloatArray:
    """Return the common time axis [s]: the finest one, over the span that all columns share, cut and resampled."""
    if not own:
        raise RecordingError(f"{path}: no column is read from it; name at least one.")
    finest = max(own.values(), key=lambda t: t.size / (t[-1] - t[0]))
    low = max(float(t[0]) for t in own.values())
    high = min(float(t[-1]) for t in own.values())
    low = low if axis.start is None else max(low, axis.start)
    high = high if axis.stop is None else min(high, axis.stop)
    grid = finest[(finest >= low) & (finest <= high)]
    if grid.size < 2:
        raise RecordingError(
            f"{path}: {grid.size} samples lie between {low:g} s and {high:g} s, at least 2 are needed;"
            f" the file runs from {finest[0]:g} s to {finest[-1]:g} s."
        )
    if axis.step is None:
        return grid
    count = int(np.floor((grid[-1] - grid[0]) / axis.step * (1 + 1e-12))) + 1
    if not 2 <= count <= 100_000_000:
        raise RecordingError(
            f"{path}: a step of {axis.step:g} s does not fit a recording of {grid[-1] - grid[0]:g} s."
        )
    resampled: FloatArray = np.minimum(grid[0] + axis.step * np.arange(count), grid[-1])
    return resampled


def _check_finite(path: Path, asked: str, values: FloatArray, time: FloatArray, kept: object) -> None:
    bad = np.flatnonzero(~np.isfinite(values) & np.asarray(kept))
    if bad.size:
        k = int(bad[0])
        raise RecordingError(
            f"{path}: column {asked!r} is {values[k]} at {time[k]:g} s (sample {k + 1}, {bad.size} in all);"
            f" repair the file or cut it with recordings.time.start and .stop."
        )


def _source_unit(path: Path, asked: str, given: str | None, stated: str | None, key: str) -> str:
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
        same = False
    if not same:
        raise UnitError(
            f"{path}: column {asked!r} is in {stated!r} by the file, but {key}.unit says {given!r};"
            f" correct one of them."
        )
    return given


def _to_unit(
    path: Path, signal: str, source: Column, stated: str | None, target: str | None, values: FloatArray
) -> FloatArray:
    if target is None and (source.unit is None or source.column is None):
        return values
    label = source.column or "value"
    key = "temperature" if signal == _TEMPERATURE else f"recordings.columns.{signal}"
    unit = _source_unit(path, label, source.unit, stated, key)
    try:
        return convert(values, unit, target or unit)
    except UnitError as error:
        raise UnitError(f"{path}: column {label!r} for {signal.strip(chr(0))!r}: {error}") from None


def _temperature(
    values: Mapping[str, FloatArray], temperature: str | Column | None, targets: Mapping[str, str | None]
) -> float | None:
    if temperature is None:
        return None
    if isinstance(temperature, Column):
        return float(np.mean(values[_TEMPERATURE]))
    return float(convert(float(np.mean(values[temperature])), targets.get(temperature) or "degC", "degC"))
