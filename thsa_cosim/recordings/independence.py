"""Which samples of a channel are measurements of their own.

A slow channel in a fast table repeats each value (held), or is filled in between (interpolated). Both show in what
happens from one sample to the next: a held channel changes, and a linearly interpolated one bends, only at every
P-th sample. The share of changes (or bends) that agree with the best period P is read off the spectrum of where
they are, so that P need not be whole: 300 Hz in a 1 kHz table changes after 3, 3 and 4 samples in turn.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.signals import FloatArray

_LEAST_MARKS = 30
"""Changes or bends that make a pattern."""
_LONGEST = 1000
"""Samples; longer periods are not looked for."""
_BEND = 1e-6
"""Share of a channel's typical bend below which it runs straight: the rounding of a text file's digits."""


@dataclass(frozen=True, eq=False)
class Independence:
    """``kind``: how samples between the ``fresh`` ones came about, None if all are measured; ``period``: samples.

    ``fresh`` holds indices into the samples.
    """

    kind: Literal["held", "interpolated"] | None
    period: float
    fresh: NDArray[np.intp]


def independence(values: FloatArray) -> Independence:
    """Return which of (n,) finite ``values`` are independent of the one before."""
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
    return everything


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
