"""Inputs as stretches of time over which every one of them is linear: what a solver may step through freely.

A solver has to stop where an input bends or jumps, and nowhere else. Recordings have samples everywhere, most of them
on the line through their neighbours up to the rounding of the file: samples are left out as long as the line through
those that stay is never further from any of them than ``merging_tolerance`` says: the samples' own rounding, and at
most ``MERGED`` of the input's range. Held inputs are never touched: each change of value is a jump.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.fmu.inputs import sampled
from thsa_cosim.fmu.variable import Variable
from thsa_cosim.signals import FloatArray, Signals

MERGED = 1e-7
"""Largest deviation of an input's course from its samples, of its range, whatever its digits."""
_SMOOTH = 1e-10
"""Deviation, of its range, that an input without rounding (a computed one) may have: far below any sensor."""
_MOST_TURNS = 64


@dataclass(frozen=True, eq=False)
class Segments:
    """m stretches: from ``starts[j]`` (m,) s on, u(t) = ``values[j]`` + ``slopes[j]`` (t - starts[j]), (m, inputs).

    ``jumps`` (m,): whether some input jumps where the stretch starts. ``stop`` ends the last one; a stretch that starts
    there has no length and says what inputs jump to at the very end.
    """

    starts: FloatArray
    values: FloatArray
    slopes: FloatArray
    jumps: NDArray[np.bool_]
    stop: float

    def __len__(self) -> int:
        return len(self.starts)


def time_slack(times: FloatArray) -> float:
    """Times closer than this are one time [s]; ``times`` (n,) are where outputs are wanted."""
    return 1e-6 * float(np.diff(times).min()) if len(times) > 1 else 1e-12


def segments(
    inputs: Signals | None,
    variables: Sequence[Variable],
    linear: NDArray[np.bool_],
    times: FloatArray,
    merged: float = MERGED,
) -> Segments:
    """Return the stretches between the first and the last of ``times`` (n,) s.

    ``linear`` (inputs,): which of the ``variables`` run linearly between samples; the others hold. ``merged``:
    see ``merging_tolerance``.
    """
    t0, t1 = float(times[0]), float(times[-1])
    if inputs is None or not variables:
        none = np.empty((1, 0))
        return Segments(np.array([t0]), none, none, np.zeros(1, dtype=bool), t1)
    slack = time_slack(times)
    samples = inputs.time[(inputs.time > t0 + slack) & (inputs.time < t1 - slack)]
    knots = np.concatenate(([t0], samples, [t1] if t1 > t0 else []))
    table = sampled(inputs, variables, knots)
    # A sample that is meant to be an output time is that time bit for bit: its row belongs to what begins there.
    nearest = times[np.clip(np.searchsorted(times, knots - slack), 0, len(times) - 1)]
    knots = np.where(np.abs(nearest - knots) <= slack, nearest, knots)

    changes = np.zeros(len(knots), dtype=bool)
    changes[1:] = (table[1:] != table[:-1])[:, ~linear].any(axis=1)
    stops = changes.copy()
    stops[[0, -1]] = True
    kept = {}
    for column in np.flatnonzero(linear):
        kept[column] = vertices(knots, table[:, column], merging_tolerance(table[:, column], merged))
        stops[kept[column]] = True
    at = np.flatnonzero(stops)
    values = table[at]
    for column, corners in kept.items():
        values[:, column] = np.interp(knots[at], knots[corners], table[corners, column])
    slopes = np.zeros_like(values)
    if len(at) > 1:
        slopes[:-1, linear] = np.diff(values[:, linear], axis=0) / np.diff(knots[at])[:, None]
    if len(at) > 1 and not changes[-1]:
        at, values, slopes = at[:-1], values[:-1], slopes[:-1]
    return Segments(
        np.ascontiguousarray(knots[at]),
        np.ascontiguousarray(values),
        np.ascontiguousarray(slopes),
        changes[at],
        t1,
    )


def merging_tolerance(values: FloatArray, merged: float = MERGED) -> float:
    """How far the course of an input may run from its samples ``values`` (n,), in their unit.

    Twice the step to which they are rounded, between 1e-10 of the range and ``merged`` of it; with ``merged`` = 0
    nothing is left out. Rounding by r leaves fourth differences of 2.4 r (standard deviation), a smooth course none;
    constant stretches and the few corners do not count.
    """
    span = float(np.ptp(values)) if len(values) else 0.0
    rough = np.abs(np.diff(values, 4))
    rough = rough[rough > 0.0]
    rounding = 0.5 * float(np.quantile(rough, 0.9)) if len(rough) else 0.0
    return min(merged * span, max(rounding, _SMOOTH * span))


def vertices(time: FloatArray, values: FloatArray, tolerance: float) -> NDArray[np.intp]:
    """Return the indices of samples whose connecting line is within ``tolerance`` of all of them; the ends are in it.

    Source: D. H. Douglas and T. K. Peucker, Cartographica 10 (1973) 112, all stretches at a time.
    """
    corners = np.array([0, len(time) - 1]) if len(time) > 1 else np.array([0])
    for _ in range(_MOST_TURNS):
        away = np.abs(values - np.interp(time, time[corners], values[corners]))
        if len(corners) < 2 or away.max() <= tolerance:
            return corners
        worst = np.maximum.reduceat(away[:-1], corners[:-1])
        # The first sample of each stretch that is as far away as its worst.
        at_worst = np.flatnonzero((away[:-1] > tolerance) & (away[:-1] == np.repeat(worst, np.diff(corners))))
        stretch = np.searchsorted(corners, at_worst, side="right")
        first = at_worst[np.unique(stretch, return_index=True)[1]]
        corners = np.union1d(corners, first)
    return np.union1d(corners, np.flatnonzero(away > tolerance))
