"""How noisy a channel is, from the recording alone.

A second difference ``d = x[k-1] - 2 x[k] + x[k+1]`` removes offset and slope and turns white noise of
standard deviation s into one of ``sqrt(6) s`` (1 + 4 + 1). Clipping at four standard deviations, repeated,
removes the kinks and steps of the signal itself, and spikes. Noise that is coloured, or a signal that bends all
the time, biases the estimate: give the noise in the scenario then.

Samples that are held, interpolated or smoothed (``independence``) carry no noise of their own: the estimate takes
one sample of each group. Codes for missing values (``outliers``) are left out.

A quantised signal with step q cannot be known better than ``q / sqrt(12)`` (uniform rounding error), however
quiet it looks: that is the floor.
"""

import numpy as np

from thsa_cosim.recordings.independence import Independence, independence
from thsa_cosim.recordings.outliers import far_values
from thsa_cosim.signals import FloatArray

_CLIP = 4.0
_CLIPPED_SHARE = 0.99906  # standard deviation of a unit normal truncated at 4
_LEAST = 16
_RESTS = 8
"""Runs of one value; more of them are a lattice's, or a command's."""
RESTING = 25
"""Samples of one value in a row that are rest, a held command, or a sensor that is stuck: not noise."""


def quantum(values: FloatArray) -> float:
    """Return the quantisation step of (n,) ``values``, in their unit, or 0 if they lie on no lattice."""
    levels = np.unique(values)
    if levels.size < 3 or 2 * levels.size > values.size:
        return 0.0
    gaps = np.diff(levels)
    # Levels split by float32 rounding are one level; what counts is how large the numbers are right there.
    largest = np.maximum(np.abs(levels[:-1]), np.abs(levels[1:]))
    gaps = gaps[gaps > 64 * float(np.finfo(np.float32).eps) * largest]
    if gaps.size == 0:
        return 0.0
    step = float(np.median(gaps[gaps <= 1.5 * gaps.min()]))
    with np.errstate(over="ignore", invalid="ignore"):
        multiples = gaps / step
        off_lattice = ~(np.abs(multiples - np.round(multiples)) <= 0.05)
    return step if np.mean(off_lattice) <= 0.01 else 0.0


def noise_estimate(values: FloatArray, *, smooth: bool = True, known: Independence | None = None) -> float:
    """Return the standard deviation of the white noise on (n,) equally spaced ``values``, in their unit.

    0 means that no noise can be seen: fewer than 16 independent samples, or a signal that never changes.
    ``smooth``: whether noise may be smooth, as :func:`independence`. ``known``: its answer for these values, where a
    caller has it already.
    """
    if values.size < _LEAST:
        return 0.0
    largest = float(np.max(np.abs(values)))
    if not np.isfinite(largest) or largest > 1e150:
        return 0.0
    codes = far_values(values)
    if known is None or codes.any():
        values = values[~codes]
        known = independence(values, smooth=smooth)
    fresh = values[known.fresh] if known.kind else values
    fresh = _without_rest(fresh)
    return white_noise(fresh) if fresh.size >= _LEAST else 0.0


def _without_rest(values: FloatArray) -> FloatArray:
    """Leave out long runs of one value (a sensor that is stuck, a held command), if enough else is there."""
    starts = np.concatenate(([0], np.flatnonzero(np.diff(values) != 0.0) + 1))
    lengths = np.diff(np.concatenate((starts, [values.size])))
    short = lengths < RESTING
    # On a coarse lattice a slow signal has long runs everywhere: those are no rest.
    usual = (
        float(np.quantile(np.repeat(lengths[short], lengths[short]), 0.9)) if short.any() else float(RESTING)
    )
    long = lengths >= max(RESTING, 10.0 * usual)
    moving = np.repeat(~long, lengths)
    enough = np.sum(moving) >= max(100, values.size // 20)
    return values[moving] if enough and np.sum(long) <= _RESTS else values


def white_noise(values: FloatArray) -> float:
    """Return the noise of (n,) independent ``values``, n at least 3, as :func:`noise_estimate`."""
    difference = np.diff(values, 2) / np.sqrt(6.0)
    spread = float(np.median(np.abs(difference))) / 0.67449
    floor = float(quantum(values) / np.sqrt(12.0))
    if spread == 0.0:
        # More than half of the differences vanish: steps on a lattice, with no noise to dither them.
        return floor
    for _ in range(20):
        inner = difference[np.abs(difference) <= _CLIP * spread]
        refined = spread * float(np.sqrt(np.mean((inner / spread) ** 2))) / _CLIPPED_SHARE
        if abs(refined - spread) <= 1e-6 * spread or refined == 0.0:
            break
        spread = refined
    return float(max(spread, floor))
