"""Read a measured file: its columns loaded, put on one time axis, conditioned signal by signal."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.errors import RecordingError
from thsa_cosim.recordings.axis import TimeAxis, common_grid, times, without_repeats
from thsa_cosim.recordings.condition import TEMPERATURE, Conditioned, conditioned, constant
from thsa_cosim.recordings.formats import load_named
from thsa_cosim.recordings.recording import Column, Recording
from thsa_cosim.recordings.table import RawColumn, sparse_rows
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.units import convert


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
        sources[TEMPERATURE] = temperature
    raw, sha256 = load_named(path, _wanted(sources, axis))
    raw, dropped = without_repeats(raw, axis)
    targets: dict[str, str | None] = {**(units or {}), TEMPERATURE: "degC"}
    own, thin = _own_times(path, raw, sources, axis)
    # A slow column is held beyond its last sample; it does not cut the fast ones.
    grid = common_grid(path, {k: t for k, t in own.items() if k not in thin} or own, axis)
    if axis.lead_in >= grid[-1] - grid[0]:
        raise RecordingError(
            f"{path}: a lead-in of {axis.lead_in:g} s leaves nothing of {grid[-1] - grid[0]:g} s to compare;"
            f" shorten it."
        )
    found: dict[str, Conditioned] = {}
    for signal, source in sources.items():
        target = targets.get(signal)
        if source.column is None:
            found[signal] = constant(path, signal, source, target, grid)
        else:
            found[signal] = conditioned(
                path,
                signal,
                source,
                raw[source.column],
                own[signal],
                grid,
                target,
                rows=thin.get(signal),
                driven=signal in driven,
            )
    notes = [note for one in found.values() for note in one.notes]
    repairs = [f"time: {dropped} rows dropped whose stamp repeats or goes back"] if dropped else []
    repairs += [repair for one in found.values() for repair in one.repairs]
    degrees = _temperature(found, temperature, targets)
    found.pop(TEMPERATURE, None)
    held = frozenset(n for n in found if columns[n].interpolation == "hold")
    stamped = grid - grid[0] if axis.from_zero else grid
    values = {n: one.values for n, one in found.items()}
    signals = Signals(stamped, values, {n: targets.get(n) or columns[n].unit or "1" for n in values}, held)
    return Recording(
        name=name or path.stem,
        path=path,
        sha256=sha256,
        signals=signals,
        temperature_degC=degrees,
        noise={n: one.noise for n, one in found.items()},
        notes=tuple(notes),
        lead_in=axis.lead_in,
        samples={n: one.samples for n, one in found.items() if one.samples is not None},
        left_out={n: one.left_out for n, one in found.items() if one.left_out is not None},
        repairs=tuple(repairs),
    )


def _wanted(sources: Mapping[str, Column], axis: TimeAxis) -> list[str]:
    """The file's columns that are needed: signals, then time axes."""
    wanted = [s.column for s in sources.values() if s.column is not None]
    wanted += [axis.column] if axis.column is not None else []
    return [*wanted, *(s.time for s in sources.values() if s.time is not None)]


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


def _temperature(
    found: Mapping[str, Conditioned], temperature: str | Column | None, targets: Mapping[str, str | None]
) -> float | None:
    if temperature is None:
        return None
    if isinstance(temperature, Column):
        return float(np.mean(found[TEMPERATURE].values))
    mean = float(np.mean(found[temperature].values))
    return float(convert(mean, targets.get(temperature) or "degC", "degC"))
