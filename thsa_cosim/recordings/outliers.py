"""Samples that are no measurements: codes for a missing value, and spikes.

Spikes are found as Hampel does (Journal of the American Statistical Association 69, 1974): by their distance from the
median of their neighbours, in units of the spread that is usual around there.
"""

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.signals import FloatArray

Mask = NDArray[np.bool_]

CODES = frozenset(
    sign * code
    for code in (
        *(full / scale for full in (32767.0, 32768.0, 65535.0, 65536.0) for scale in (10.0, 100.0, 1000.0)),
        999.0,
        9999.0,
        99999.0,
        999.9,
        9999.9,
        32767.0,
        32768.0,
        65535.0,
        65536.0,
        2147483647.0,
        1e30,
    )
    for sign in (1.0, -1.0)
)
"""Numbers that loggers write where they have none."""
_FAR = 10.0
"""Times the range of everything else: nothing that is measured jumps so far."""
_ROUGH = 0.55
"""Median distance of white noise of 1 σ from its running median over seven samples."""
_NEAR_CODE = 1.0
"""The same, for a number that is a known code."""


def far_values(values: FloatArray) -> Mask:
    """Return which of (n,) finite ``values`` are codes: few values, apart from all others by far; (n,) of bool."""
    codes = np.zeros(values.shape, dtype=np.bool_)
    levels, counts = np.unique(values, return_counts=True)
    while levels.size > 2:
        rest = values.size - int(np.sum(codes))
        for value, beside, opposite, count, others in (
            (levels[0], levels[1], levels[-1], counts[0], slice(1, None)),
            (levels[-1], levels[-2], levels[0], counts[-1], slice(None, -1)),
        ):
            span = abs(float(opposite) - float(beside))
            limit = _NEAR_CODE if float(value) in CODES else _FAR
            if span > 0.0 and abs(float(value) - float(beside)) > limit * span and count < 0.5 * rest:
                codes |= values == value
                levels, counts = levels[others], counts[others]
                break
        else:
            break
    return codes


def running_median(values: FloatArray, width: int = 5) -> FloatArray:
    """Return the median of ``width`` (odd) samples around each of (n,) ``values``, fewer at the ends."""
    half = width // 2
    padded = np.concatenate((values[half:0:-1], values, values[-2 : -half - 2 : -1]))
    windows = np.lib.stride_tricks.sliding_window_view(padded, width)
    return row_medians(windows)


def row_medians(rows: FloatArray) -> FloatArray:
    """Return the median of each row of (n, m), NaN where one is NaN: numpy.median, which takes longer for many rows."""
    ordered = np.sort(rows, axis=-1)
    m = ordered.shape[-1]
    middle = ordered[:, m // 2] if m % 2 else 0.5 * (ordered[:, m // 2 - 1] + ordered[:, m // 2])
    return np.asarray(np.where(np.isnan(ordered[:, -1]), np.nan, middle))


def spikes(values: FloatArray, noise: float, threshold: float = 6.0) -> Mask:
    """Return which of (n,) ``values`` are spikes of one or two samples; (n,) of bool.

    ``noise``: 1 σ of the usual noise, in the values' unit. A sample counts if it is ``threshold`` of them away from
    what comes before and from what follows, on the same side of both, and further than these lie from each other.
    Where the signal is rougher than usual, the limit is higher.
    """
    found = np.zeros(values.shape, dtype=np.bool_)
    if values.size < 32 or not noise > 0.0:
        return found
    middle = running_median(values, 7)
    rough = np.abs(values - middle)
    limit = threshold * np.maximum(noise, running_median(rough, 51) / _ROUGH)
    for skip in (0, 1):  # a spike of two samples has a neighbour that is one, too
        before, after, flanks = _beside(values, 2 + skip)
        away = np.minimum(np.abs(values - before), np.abs(values - after))
        same_side = (values - before) * (values - after) > 0.0
        found |= (
            same_side & (away > limit + np.abs(after - before) + flanks) & (np.abs(values - middle) > limit)
        )
    found[:3] = found[-3:] = False  # at the ends there is no before and after
    return found


def _beside(values: FloatArray, shift: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Median of three samples ``shift`` before and after each of (n,), and what the slope beyond them makes of it."""
    middle = running_median(values, 3)
    padded = np.pad(middle, shift + 3, mode="edge")
    n = values.size
    before, earlier = padded[3 : 3 + n], padded[:n]
    after, later = padded[3 + 2 * shift :][:n], padded[6 + 2 * shift :][:n]
    flanks = (np.abs(before - earlier) + np.abs(after - later)) * (shift / 3.0)
    return before, after, flanks
