"""A recording: measured signals in the FMU's names and units, checked once, here."""

import hashlib
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.errors import RecordingError, ThsaCosimError, UnitError, did_you_mean, did_you_mean_path
from thsa_cosim.recordings import foreign
from thsa_cosim.recordings.axis import (
    TimeAxis,
    check_finite,
    common_grid,
    source_unit,
    times,
    without_repeats,
)
from thsa_cosim.recordings.noise import noise_estimate
from thsa_cosim.recordings.outliers import Mask
from thsa_cosim.recordings.repair import Repair, coded, repaired
from thsa_cosim.recordings.table import Choose, RawColumn, resolve, sparse_rows
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.units import convert

SUFFIXES: Mapping[str, str] = {
    **dict.fromkeys((".csv", ".txt", ".tsv", ".dat", ".asc", ".lvm"), "csv"),
    **dict.fromkeys((".parquet", ".pq"), "parquet"),
    **dict.fromkeys((".mf4", ".mdf"), "mf4"),
    ".mat": "mat",
    ".json": "json",
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
    unwrap
        Period of the file's numbers, where a counter or an angle starts again; taken out before ``scale``.
    shift
        s; the signal is moved to later times by this much (negative: a sensor lag is taken out).
    smooth
        ``"mean"`` replaces the signal by its mean, ``"piecewise-linear"`` by the continuous piecewise-linear
        function with as few knots as its noise warrants (``piecewise``).
    noise
        1 σ of the white noise that ``"piecewise-linear"`` removes, in the FMU variable's unit; None: estimated.
    interpolation
        ``"linear"`` between samples, or ``"hold"``: the value stays until the next sample, as a digital
        command does.
    repair
        Samples that do not count.
    time
        Name of a time column of its own; None: the recording's.
    """

    column: str | None = None
    unit: str | None = None
    value: float | None = None
    scale: float = 1.0
    offset: float = 0.0
    unwrap: float | None = None
    shift: float = 0.0
    smooth: Literal["none", "mean", "piecewise-linear"] = "none"
    noise: float | None = None
    interpolation: Literal["linear", "hold"] = "linear"
    repair: Repair = field(default_factory=Repair)
    time: str | None = None


@dataclass(frozen=True, eq=False)
class Samples:
    """A signal as the file holds it within the cut, in the FMU variable's unit: nothing smoothed, shifted, resampled.

    ``time``, ``values``: (n,); ``left_out`` (n,): what the scenario's repairs leave out. ``held``: by
    ``interpolation = "hold"``; ``averaged``: by ``smooth = "mean"``. ``written`` (n,): the file's own numbers.
    """

    time: FloatArray
    values: FloatArray
    unit: str
    left_out: Mask
    held: bool = False
    averaged: bool = False
    written: FloatArray | None = None


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
    notes: tuple[str, ...] = ()
    """What a reader of results should know: sentences."""
    lead_in: float = 0.0
    """s at the beginning that only bring a model into the right state: they drive it and are not compared."""
    samples: Mapping[str, Samples] = field(default_factory=dict)
    """What ``signals`` were made of, by the same names; constants are not among them."""
    left_out: Mapping[str, Mask] = field(default_factory=dict)
    """Samples of ``signals`` (n,) that repairs leave out, for the signals that have any."""
    repairs: tuple[str, ...] = ()
    """What the scenario's repairs did: sentences."""
    start: Mapping[str, float] = field(default_factory=dict)
    """Start values that this recording gives the FMU's parameters, in the FMU's units: its gain, its first position."""

    def with_start(self, names: Sequence[str]) -> "Recording":
        """Return the recording with the signals ``names`` turned into start values: each one's first sample."""
        if not names:
            return self
        return replace(
            self,
            signals=self.signals.select(n for n in self.signals.names if n not in names),
            noise={n: v for n, v in self.noise.items() if n not in names},
            samples={n: s for n, s in self.samples.items() if n not in names},
            left_out={n: m for n, m in self.left_out.items() if n not in names},
            start={n: float(self.signals[n][0]) for n in names},
        )

    @property
    def duration(self) -> float:
        """Length in s."""
        return float(self.signals.time[-1] - self.signals.time[0])

    def counted(self, name: str) -> Mask:
        """Which samples of :attr:`compared` count for a signal: all but those that repairs leave out; (n,) of bool."""
        kept = np.ones(self.signals.time.shape, dtype=np.bool_)
        if name in self.left_out:
            kept = ~self.left_out[name]
        return kept[kept.size - len(self.compared) :]

    @property
    def compared(self) -> Signals:
        """The signals after the lead-in."""
        # Times are sums and differences of rounded numbers: a sample at the border belongs to what follows.
        first = self.signals.time[0] + self.lead_in * (1.0 - 1e-9) - 1e-12
        return self.signals.window(first) if self.lead_in > 0.0 else self.signals


def column_names(path: Path | str) -> tuple[str, ...]:
    """Return the names of a file's columns; RecordingError as :func:`read_recording`."""
    names: list[str] = []

    def note(found: Sequence[str]) -> Sequence[str]:
        names.extend(found)
        return ()

    _load(Path(path), note)
    return tuple(names)


def load_columns(path: Path | str) -> dict[str, RawColumn]:
    """Return all columns of a file as it holds them; RecordingError as :func:`read_recording`."""
    return _load(Path(path), lambda names: names)[0]


def read_recording(
    path: Path | str,
    columns: Mapping[str, Column],
    *,
    time: TimeAxis | None = None,
    units: Mapping[str, str | None] | None = None,
    temperature: str | Column | None = None,
    name: str | None = None,
    driven: Collection[str] = (),
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
    driven
        Signals that drive the FMU: they need a value at every moment.

    Raises
    ------
    RecordingError
        If the file is missing, unreadable or empty, a column is unknown, not numeric or not finite, time
        does not increase, or nothing is left after the lead-in.
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
    raw, dropped = without_repeats(raw, axis)
    targets: dict[str, str | None] = {**(units or {}), _TEMPERATURE: "degC"}
    own, thin = _own_times(path, raw, sources, axis)
    # A slow column is held beyond its last sample; it does not cut the fast ones.
    grid = common_grid(path, {k: t for k, t in own.items() if k not in thin} or own, axis)
    if axis.lead_in >= grid[-1] - grid[0]:
        raise RecordingError(
            f"{path}: a lead-in of {axis.lead_in:g} s leaves nothing of {grid[-1] - grid[0]:g} s to compare;"
            f" shorten it."
        )
    values: dict[str, FloatArray] = {}
    noise: dict[str, float] = {}
    notes: list[str] = []
    samples: dict[str, Samples] = {}
    left_out: dict[str, Mask] = {}
    repairs = [f"time: {dropped} rows dropped whose stamp repeats or goes back"] if dropped else []
    for signal, source in sources.items():
        if source.column is None:
            unit = source.unit or targets.get(signal) or "1"
            constant = _to_unit(
                path, signal, source, unit, targets.get(signal), np.array([source.value or 0.0])
            )
            values[signal], noise[signal] = np.full(grid.shape, constant[0]), 0.0
            continue
        column, t = raw[source.column], own[signal]
        if signal in thin:
            column = replace(column, values=column.values[thin[signal]])
            notes.append(
                f"{path}: {source.column!r} has a value in one row of {_every(thin[signal])}: read so."
            )
        kept = (t >= grid[0]) & (t <= grid[-1])
        if signal in thin and np.sum(kept) < 2:
            kept = np.ones(t.shape, dtype=np.bool_)
        missing = coded(column.values, source.repair)
        check_finite(path, source.column, column.values, t, kept & ~missing)
        with np.errstate(over="ignore", invalid="ignore"):
            numbers = source.scale * _unwrapped(column.values, source.unwrap) + source.offset
            numbers = _to_unit(path, signal, source, column.unit, targets.get(signal), numbers)
        check_finite(path, source.column, numbers, t, kept & ~missing)
        mended = repaired(
            path, signal, t[kept], numbers[kept], missing[kept], source.repair, driven=signal in driven
        )
        measured = numbers[kept]
        written = column.values[kept]
        unit = targets.get(signal) or source.unit or column.unit or "1"
        held_here = source.interpolation == "hold"
        samples[signal] = Samples(
            _shared(t[kept], [other.time for other in samples.values()]),
            measured,
            unit,
            mended.left_out,
            held_here,
            source.smooth == "mean",
            _shared(written, [measured]),
        )
        repairs += mended.done
        if source.unwrap is not None:
            turns = int(
                np.sum(
                    np.abs(np.diff(_unwrapped(column.values, source.unwrap) - column.values))
                    > 0.5 * source.unwrap
                )
            )
            repairs.append(f"{signal}: unwrapped {turns} times by {source.unwrap:g} of the file's numbers")
        if mended.left_out.any():
            numbers = numbers.copy()
            numbers[kept] = mended.values
            left_out[signal] = _on_grid(mended.left_out, t[kept], grid - source.shift)
            measured = measured[~mended.left_out]
        noise[signal] = noise_estimate(measured)
        if source.smooth == "piecewise-linear":
            from thsa_cosim.recordings.piecewise import (
                fit_piecewise_linear,
            )  # its linear algebra takes time to load

            fit = fit_piecewise_linear(t[kept], numbers[kept], source.noise or noise[signal])
            if fit.doubt:
                notes.append(f"{path}: {signal} is used as measured, not piecewise linear: {fit.doubt}.")
            else:
                numbers = numbers.copy()
                numbers[kept] = fit.at(t[kept])
        if source.smooth == "mean":
            values[signal] = np.full(grid.shape, float(np.mean(numbers[kept])))
        elif source.shift == 0.0 and np.array_equal(t[kept], grid):
            values[signal] = _shared(numbers[kept], [measured])
        else:
            held = frozenset((signal,)) if source.interpolation == "hold" else frozenset()
            values[signal] = Signals(t, {signal: numbers}, held=held).resample(grid - source.shift)[signal]
    degrees = _temperature(values, temperature, targets)
    for found in (values, noise, samples, left_out):
        found.pop(_TEMPERATURE, None)
    held = frozenset(n for n in values if columns[n].interpolation == "hold")
    stamped = grid - grid[0] if axis.from_zero else grid
    signals = Signals(stamped, values, {n: targets.get(n) or columns[n].unit or "1" for n in values}, held)
    return Recording(
        name or path.stem,
        path,
        sha256,
        signals,
        degrees,
        noise,
        tuple(notes),
        axis.lead_in,
        samples,
        left_out,
        tuple(repairs),
    )


_TEMPERATURE = "\0temperature"


def _shared(values: FloatArray, others: Sequence[FloatArray]) -> FloatArray:
    """One of ``others`` that is the same, so that it is held once: a long recording has many equal columns."""
    return next((other for other in others if np.array_equal(values, other, equal_nan=True)), values)


def _own_times(
    path: Path, raw: Mapping[str, RawColumn], sources: Mapping[str, Column], axis: TimeAxis
) -> tuple[dict[str, FloatArray], dict[str, NDArray[np.intp]]]:
    """Times [s] of each signal's samples, and the rows that hold them for signals of a lower rate than the table."""
    own: dict[str, FloatArray] = {}
    thin: dict[str, NDArray[np.intp]] = {}
    for signal, source in sources.items():
        if source.column is None:
            continue
        column, stamps = raw[source.column], axis.column if source.time is None else source.time
        rows = sparse_rows(column.values) if source.repair.missing is None else None
        if rows is None and source.time is not None and source.time in raw:
            # Columns of another rate side by side: the shorter ones end in blank cells.
            filled = np.isfinite(raw[source.time].values) & np.isfinite(column.values)
            rows = None if filled.all() else np.flatnonzero(filled)
        if rows is None:
            own[signal] = times(path, source.column, raw, replace(axis, column=stamps))
            continue
        thin[signal] = rows
        short = {source.column: _rows(column, rows)}
        if stamps is not None:
            short[stamps] = _rows(raw[stamps], rows)
        own[signal] = times(path, source.column, short, replace(axis, column=stamps))
    return own, thin


def _rows(column: RawColumn, rows: NDArray[np.intp]) -> RawColumn:
    time = None if column.time is None else column.time[rows]
    return replace(column, values=column.values[rows], time=time)


def _every(rows: NDArray[np.intp]) -> int:
    return round(float(np.median(np.diff(rows))))


def _on_grid(left_out: Mask, time: FloatArray, grid: FloatArray) -> Mask:
    """Which points of ``grid`` (m,) s rest on samples (n,) at ``time`` that are left out."""
    slack = 1e-6 * float(np.min(np.diff(time)))
    before = np.clip(np.searchsorted(time, grid + slack, side="right") - 1, 0, time.size - 1)
    after = np.clip(np.searchsorted(time, grid - slack, side="left"), 0, time.size - 1)
    return np.asarray(left_out[before] | left_out[after])


def _load_chosen(
    path: Path, sources: Mapping[str, Column], axis: TimeAxis
) -> tuple[dict[str, RawColumn], str]:
    """Load the columns that are asked for, under the names by which they are asked for."""
    wanted = [s.column for s in sources.values() if s.column is not None]
    wanted += [axis.column] if axis.column is not None else []
    wanted += [s.time for s in sources.values() if s.time is not None]
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
        near = "" if path.exists() else did_you_mean_path(path)
        hint = near or did_you_mean(suffix, SUFFIXES) or f" Known endings: {', '.join(SUFFIXES)}."
        raise RecordingError(f"{path}: file ending {suffix!r} is not a known recording format.{hint}")
    if path.exists() and not path.is_file():  # a pipe would wait for ever, a device has no end
        raise RecordingError(f"{path}: cannot be read (it is a folder, pipe or device); name a file.")
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise RecordingError(f"{path}: no such file; check the path.{did_you_mean_path(path)}") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise RecordingError(f"{path}: cannot be read ({reason}).") from None
    if not content:
        raise RecordingError(f"{path}: is empty; record or export it again.")
    try:
        return _read(SUFFIXES[suffix], path, choose), hashlib.sha256(content).hexdigest()
    except ThsaCosimError:
        raise
    except Exception as error:  # the parsers raise anything on a damaged file
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise RecordingError(
            f"{path}: is no readable {SUFFIXES[suffix]} file ({reason.rstrip('.')}); export it again."
        ) from None


def _read(format_: str, path: Path, choose: Choose) -> dict[str, RawColumn]:
    if format_ in foreign.FORMATS:
        return foreign.read(format_, path, choose)
    read: Callable[[Path, Choose], dict[str, RawColumn]]
    read = import_module(f"thsa_cosim.recordings.{format_}").read
    return read(path, choose)


def _to_unit(
    path: Path, signal: str, source: Column, stated: str | None, target: str | None, values: FloatArray
) -> FloatArray:
    if target is None and (source.unit is None or source.column is None):
        return values
    label = source.column or "value"
    key = "temperature" if signal == _TEMPERATURE else f"recordings.columns.{signal}"
    unit = source_unit(path, label, source.unit, stated, key)
    try:
        return convert(values, unit, target or unit)
    except UnitError as error:
        raise UnitError(f"{path}: column {label!r} for {signal.strip(chr(0))!r}: {error}") from None


def _unwrapped(values: FloatArray, period: float | None) -> FloatArray:
    """(n,) values without the jumps of a counter that starts again after ``period``."""
    if period is None:
        return values
    finite = np.isfinite(values)
    found = values.copy()
    found[finite] = np.unwrap(values[finite], period=period)
    return found


def _temperature(
    values: Mapping[str, FloatArray], temperature: str | Column | None, targets: Mapping[str, str | None]
) -> float | None:
    if temperature is None:
        return None
    if isinstance(temperature, Column):
        return float(np.mean(values[_TEMPERATURE]))
    return float(convert(float(np.mean(values[temperature])), targets.get(temperature) or "degC", "degC"))
