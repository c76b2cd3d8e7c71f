"""Which samples of a channel are measurements of their own.

A slow channel in a fast table repeats each value (held), or is filled in between (interpolated). Both show in what
happens from one sample to the next: a held channel changes, and a linearly interpolated one bends, only at every
P-th sample. The share of changes (or bends) that agree with the best period P is read off the spectrum of where
they are, so that P need not be whole: 300 Hz in a 1 kHz table changes after 3, 3 and 4 samples in turn.

Filled in by a spline, by a resampler's sinc, or by lines that were rounded afterwards, or run through a low-pass, a
channel bends everywhere, but its noise is smooth: second differences over m samples grow with m, up to where samples
have nothing to do with each other, and stay there. White noise does not grow, motion does not stay.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.recordings.outliers import row_medians
from thsa_cosim.signals import FloatArray

_LEAST_MARKS = 30
"""Changes or bends that make a pattern."""
_LONGEST = 1000
"""Samples; longer periods are not looked for."""
_SPREADS: NDArray[np.intp] = np.unique(np.round(2.0 ** np.arange(0.0, 7.01, 0.5)).astype(np.intp))
"""Samples over which second differences are taken."""
_GROWN, _LEVEL = 0.45, 0.72
"""Smooth noise: what neighbours differ by, in shares of what independent samples do, at most; how level these are.
Set on the recordings that ship and on public ones of three drives."""
_LATTICE = 6.0
"""Quantisation steps that smooth noise has to reach: less is the lattice's own."""
_REST = 25
"""Samples of one value in a row that are no noise at all."""
_QUIET = 0.25
"""Share of the windows that counts: those in which least moves."""
_BEND = 1e-6
"""Share of a channel's typical bend below which it runs straight: the rounding of a text file's digits."""


@dataclass(frozen=True, eq=False)
class Independence:
    """``kind``: how samples between the ``fresh`` ones came about, None if all are measured; ``period``: samples.

    ``"interpolated"`` runs straight between the fresh ones, ``"smooth"`` in any other way: by a spline or a low-pass.
    ``fresh`` holds indices into the samples.
    """

    kind: Literal["held", "interpolated", "smooth"] | None
    period: float
    fresh: NDArray[np.intp]


def independence(values: FloatArray, *, smooth: bool = True) -> Independence:
    """Return which of (n,) finite ``values`` are independent of the one before.

    Without ``smooth``, noise is taken for white: what a fit leaves may be smooth by itself.
    """
    everything = Independence(None, 1.0, np.arange(values.size))
    if values.size < 3 * _LEAST_MARKS:
        return everything
    changes = np.flatnonzero(np.diff(values) != 0.0) + 1
    period = _period(changes, values.size)
    if period is not None:
        return Independence("held", period, np.concatenate(([0], changes)))
    bends = _bends(values)
    period = _period(bends, values.size)
    if period is not None:
        return Independence("interpolated", period, bends)
    correlated = _correlated(values) if smooth else None
    if correlated is not None:
        return Independence("smooth", float(correlated), np.arange(0, values.size, correlated))
    return everything


def _correlated(values: FloatArray) -> int | None:
    """Over how many samples the noise on (n,) values is smooth; None if it is white, or cannot be seen."""
    starts = np.concatenate(([0], np.flatnonzero(np.diff(values) != 0.0) + 1))
    lengths = np.diff(np.concatenate((starts, [values.size])))
    values = values[np.repeat(lengths < _REST, lengths)]  # a sensor that is stuck, or rests
    if values.size < 3 * _LEAST_MARKS:
        return None
    window = max(24, min(128, values.size // 50))
    levels: list[float] = []
    for m in _SPREADS:
        bends = np.abs(values[: -2 * m] - 2.0 * values[m:-m] + values[2 * m :])
        windows = bends[: bends.size // window * window].reshape(-1, window)
        if windows.shape[0] < 8:
            break
        middles = row_medians(windows)
        middles = middles[middles > 0.0]
        if middles.size < max(6, 0.5 * windows.shape[0]):
            return None  # mostly at rest, or on a coarse lattice
        levels.append(float(np.quantile(middles, _QUIET)))
    for k in range(1, len(levels) - 3):
        grown, level = (
            levels[0] < _GROWN * levels[k],
            min(levels[k : k + 4]) > _LEVEL * max(levels[k : k + 4]),
        )
        # A ripple of the motion comes back to itself after its period: noise never does.
        if grown and level and min(levels[k:]) > _LEVEL * levels[k]:
            return int(_SPREADS[k]) if levels[k] > _LATTICE * lattice_step(values) else None
    return None


def lattice_step(values: FloatArray) -> float:
    """Return the usual smallest distance of two different ones of (n,) values; 0 if all are equal.

    On a lattice this is its step; without one, it is far below any noise.
    """
    found = np.unique(values)
    gaps = np.diff(found)
    largest = np.maximum(np.abs(found[:-1]), np.abs(found[1:]))
    gaps = gaps[gaps > 64 * float(np.finfo(np.float32).eps) * largest]  # levels split by rounding are one
    return float(np.median(gaps[gaps <= 1.5 * np.quantile(gaps, 0.1)])) if gaps.size else 0.0


def _bends(values: FloatArray) -> NDArray[np.intp]:
    """Indices at which the line through the samples bends, by more than rounding."""
    bend = np.abs(np.diff(values, 2))
    rounding = 8.0 * np.finfo(np.float64).eps * float(np.max(np.abs(values)))
    typical = float(np.quantile(bend, 0.98))
    found: NDArray[np.intp] = np.flatnonzero(bend > max(_BEND * typical, rounding)) + 1
    return found


def _period(marks: NDArray[np.intp], n: int) -> float | None:
    """Return the period, 2 samples or more, that ``marks`` among n samples keep; None if they keep none.

    Marks may be missing (a value that stays, a straight stretch), but where they come close to each other they have
    to come with the period: less than a tenth as neighbours.
    """
    if marks.size < _LEAST_MARKS or marks.size > 0.55 * n:
        return None
    distances = np.diff(marks)
    near = distances[distances <= _LONGEST]
    if near.size < _LEAST_MARKS - 1:
        return None
    shortest = float(np.quantile(near, 0.1))
    if shortest < 2.0:
        return None
    best = _strongest(marks, shortest)
    if best is None:
        return None
    # A channel that rests most of the time keeps any period by chance; its moving stretches have to be full of marks.
    busy = np.mean(near < 1.6 * best)
    return best if busy > 0.5 else None


def _strongest(marks: NDArray[np.intp], shortest: float) -> float | None:
    """Return the period near ``shortest`` that most marks agree with, if they do."""
    low, high = max(2.0, 0.9 * shortest), min(1.6 * shortest + 1.0, float(_LONGEST))
    whole = np.arange(np.ceil(low), np.floor(high) + 1.0)
    for period in whole[::-1].tolist():
        if np.bincount(marks % int(period)).max() > 0.95 * marks.size:
            return float(period)
    # Marks of a period that is not whole fall up to a sample late: consecutive distances say it best.
    distances = np.diff(marks)
    close = distances[distances < 1.5 * shortest + 1.0]
    period = float(np.mean(close))
    if not low <= period <= high or period < 2.0:
        return None
    around = np.abs(close - period) < 1.0
    return period if np.mean(around) > 0.97 else None
