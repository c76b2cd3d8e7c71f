"""One column of a file → one signal of a recording: unit, unwrapping, repair, noise, smoothing, time axis."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.errors import UnitError
from thsa_cosim.recordings.axis import check_finite, source_unit
from thsa_cosim.recordings.noise import noise_estimate
from thsa_cosim.recordings.outliers import Mask
from thsa_cosim.recordings.recording import Column, Samples
from thsa_cosim.recordings.repair import coded, repaired
from thsa_cosim.recordings.table import RawColumn
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.units import convert

TEMPERATURE = "\0temperature"
"""Name of a signal that only gives the recording its temperature."""


@dataclass(frozen=True, eq=False)
class Conditioned:
    """A signal on the recording's time axis (m,), and what was done to it."""

    values: FloatArray
    noise: float = 0.0
    """1 σ of its white noise."""
    samples: Samples | None = None
    """What it was made of; None for a constant."""
    left_out: Mask | None = None
    """(m,) what repairs leave out; None: nothing."""
    notes: tuple[str, ...] = ()
    repairs: tuple[str, ...] = ()


def constant(path: Path, signal: str, source: Column, target: str | None, grid: FloatArray) -> Conditioned:
    """Return the constant of ``source`` at every time of ``grid`` (m,); UnitError as :func:`conditioned`."""
    unit = source.unit or target or "1"
    value = _to_unit(path, signal, source, unit, target, np.array([source.value or 0.0]))
    return Conditioned(np.full(grid.shape, value[0]))


def conditioned(
    path: Path,
    signal: str,
    source: Column,
    column: RawColumn,
    time: FloatArray,
    grid: FloatArray,
    target: str | None,
    *,
    rows: NDArray[np.intp] | None = None,
    driven: bool = False,
) -> Conditioned:
    """Return ``column`` as ``source`` asks, in the unit ``target``, on ``grid`` (m,) s.

    ``time`` (n,) s: of its samples. ``rows`` (n,): those of the file's rows that hold a value, of a column of a lower
    rate. ``driven``: it drives the FMU and needs a value at every moment.

    Raises
    ------
    RecordingError
        If a value is not finite, or a repair is not possible.
    UnitError
        If a unit is unknown, missing, or contradicts the file or the FMU.
    """
    assert source.column is not None
    notes: list[str] = []
    if rows is not None:
        column = replace(column, values=column.values[rows])
        notes.append(f"{path}: {source.column!r} has a value in one row of {_every(rows)}: read so.")
    kept = (time >= grid[0]) & (time <= grid[-1])
    if rows is not None and np.sum(kept) < 2:
        kept = np.ones(time.shape, dtype=np.bool_)
    missing = coded(column.values, source.repair)
    check_finite(path, source.column, column.values, time, kept & ~missing)
    with np.errstate(over="ignore", invalid="ignore"):
        numbers = source.scale * _unwrapped(column.values, source.unwrap) + source.offset
        numbers = _to_unit(path, signal, source, column.unit, target, numbers)
    check_finite(path, source.column, numbers, time, kept & ~missing)
    mended = repaired(path, signal, time[kept], numbers[kept], missing[kept], source.repair, driven=driven)
    measured = numbers[kept]
    samples = Samples(
        _shared(time[kept], grid),
        measured,
        target or source.unit or column.unit or "1",
        mended.left_out,
        source.interpolation == "hold",
        source.smooth == "mean",
        _shared(column.values[kept], measured),
    )
    left_out: Mask | None = None
    if mended.left_out.any():
        numbers = numbers.copy()
        numbers[kept] = mended.values
        left_out = _on_grid(mended.left_out, time[kept], grid - source.shift)
        measured = measured[~mended.left_out]
    noise = noise_estimate(measured)
    if source.smooth == "piecewise-linear":
        numbers, doubt = _piecewise_linear(time, numbers, kept, source.noise or noise)
        if doubt:
            notes.append(f"{path}: {signal} is used as measured, not piecewise linear: {doubt}.")
    values = _shared(_resampled(signal, source, time, numbers, kept, grid), samples.values)
    repairs = (*mended.done, *_turns(signal, column.values, source.unwrap))
    return Conditioned(values, noise, samples, left_out, tuple(notes), repairs)


def _piecewise_linear(
    time: FloatArray, numbers: FloatArray, kept: Mask, noise: float
) -> tuple[FloatArray, str]:
    """(n,) numbers whose kept samples lie on few straight lines, or as they were, and why they stayed so."""
    from thsa_cosim.recordings.piecewise import fit_piecewise_linear  # its linear algebra takes time to load

    fit = fit_piecewise_linear(time[kept], numbers[kept], noise)
    if fit.doubt:
        return numbers, fit.doubt
    found = numbers.copy()
    found[kept] = fit.at(time[kept])
    return found, ""


def _resampled(
    signal: str, source: Column, time: FloatArray, numbers: FloatArray, kept: Mask, grid: FloatArray
) -> FloatArray:
    """(m,) the signal at the times of the recording."""
    if source.smooth == "mean":
        return np.full(grid.shape, float(np.mean(numbers[kept])))
    if source.shift == 0.0 and np.array_equal(time[kept], grid):
        return numbers[kept]
    held = frozenset((signal,)) if source.interpolation == "hold" else frozenset()
    return Signals(time, {signal: numbers}, held=held).resample(grid - source.shift)[signal]


def _shared(values: FloatArray, other: FloatArray) -> FloatArray:
    """``other`` if it is the same: a long recording has many equal columns, which are held once."""
    return other if np.array_equal(values, other) else values


def _turns(signal: str, written: FloatArray, period: float | None) -> tuple[str, ...]:
    """How often a counter of ``period`` started again, in a sentence; nothing where none was unwrapped."""
    if period is None:
        return ()
    jumps = np.abs(np.diff(_unwrapped(written, period) - written))
    turns = int(np.sum(jumps > 0.5 * period))
    return (f"{signal}: unwrapped {turns} times by {period:g} of the file's numbers",)


def _every(rows: NDArray[np.intp]) -> int:
    return round(float(np.median(np.diff(rows))))


def _on_grid(left_out: Mask, time: FloatArray, grid: FloatArray) -> Mask:
    """Which points of ``grid`` (m,) s rest on samples (n,) at ``time`` that are left out."""
    slack = 1e-6 * float(np.min(np.diff(time)))
    before = np.clip(np.searchsorted(time, grid + slack, side="right") - 1, 0, time.size - 1)
    after = np.clip(np.searchsorted(time, grid - slack, side="left"), 0, time.size - 1)
    return np.asarray(left_out[before] | left_out[after])


def _to_unit(
    path: Path, signal: str, source: Column, stated: str | None, target: str | None, values: FloatArray
) -> FloatArray:
    if target is None and (source.unit is None or source.column is None):
        return values
    label = source.column or "value"
    key = "temperature" if signal == TEMPERATURE else f"recordings.columns.{signal}"
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
