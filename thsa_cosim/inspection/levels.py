"""Values that never occur: a bit of a converter that is stuck, a dead band about zero.

Noise and motion put samples on all levels of a range. Holes of one width at one distance are a converter's that has
lost a bit; a hole about zero, which the signal crosses in one leap each time, is a threshold's.
"""

from collections.abc import Iterator

import numpy as np

from thsa_cosim.inspection.channel import Channel
from thsa_cosim.inspection.finding import Finding
from thsa_cosim.signals import FloatArray

_WIDE = 5.0
"""Usual distances of levels that make a hole."""
_HOLES, _APART = 4, 0.12
"""Holes, and by what share of the distance they may be off their place."""
_FILLED = 3
"""Levels between two holes that show that there is no lack of samples."""
_HALF = (0.3, 0.7)
"""Width of a hole in distances: a bit that is stuck keeps half of the levels."""
_LEAST = 200
_LEAPS, _CLEAR, _NOISES = 6, 20.0, 3.0
"""Crossings of a dead band; its width in usual distances of levels, and in σ."""
_SLOW = 0.3
"""Change after a leap out of the band, in shares of the leap: what is fast by itself goes on so."""


def stuck_bit(channel: Channel) -> Iterator[Finding]:
    """Levels that are missing at regular distances."""
    if channel.averaged or channel.silent or channel.values.size < _LEAST:
        return
    levels = np.unique(channel.plain)
    gaps = np.diff(levels)
    usual = float(np.median(gaps)) if gaps.size >= _LEAST // 4 else 0.0
    if usual <= 0.0:
        return
    at = np.flatnonzero(gaps > _WIDE * usual)
    inner = at[(levels[at] > levels[0]) & (levels[at + 1] < levels[-1])]
    if inner.size < _HOLES:
        return
    distances = np.diff(levels[inner])
    period = float(np.median(distances))
    filled = float(np.median(np.diff(inner))) >= _FILLED
    regular = float(np.mean(np.abs(distances / period - np.round(distances / period)) < _APART))
    width = float(np.median(gaps[inner])) / period
    # Where the signal is fast or seldom, levels are missing here and there: not most of them, and not alike.
    alike = float(np.mean(np.abs(gaps[inner] / np.median(gaps[inner]) - 1.0) < _APART))
    if not filled or regular < 0.9 or alike < 0.8 or not _HALF[0] < width < _HALF[1]:
        return
    text = (
        f"{channel.name} has no values in {inner.size} stretches of {channel.number(width * period)} each, one every"
        f" {channel.number(period)}: a bit of its converter is stuck"
    )
    yield channel.finding("stuck-bit", "error", text)


def dead_band(channel: Channel) -> Iterator[Finding]:
    """A signal that is either zero or larger than a threshold."""
    if channel.averaged or channel.silent or channel.role == "input" or channel.values.size < _LEAST:
        return
    values = channel.clean
    positive, negative = values[values > 0.0], values[values < 0.0]
    if not (positive.size and negative.size) or not np.any(values == 0.0):
        return
    width = float(min(positive.min(), -negative.max()))
    gaps = np.diff(np.unique(np.abs(values[values != 0.0])))
    gaps = gaps[gaps > 1e-9 * channel.range]
    usual = float(np.median(gaps)) if gaps.size else 0.0
    if width < max(_CLEAR * usual, _NOISES * _own_noise(values, width)):
        return
    out = np.flatnonzero((values[1:-1] == 0.0) & (values[2:] != 0.0)) + 1  # the last zero before a leap
    out = out[out + 2 < values.size]
    out = out[values[out + 2] != 0.0]  # noise on the threshold hops to and fro
    leaps = np.abs(values[out + 1])
    after = np.abs(values[out + 2] - values[out + 1])
    slow = (after < _SLOW * leaps) & (leaps < 1.5 * width)
    if out.size < _LEAPS or np.sum(slow) < 0.6 * out.size:
        return
    share = 100.0 * float(np.mean(values == 0.0))
    text = (
        f"{channel.name} is 0 or more than {channel.number(width)}, never between ({share:.2g} % of its samples are 0):"
        " a dead band of its sensor or converter"
    )
    remedy = (
        f"[recordings.columns.{channel.name}]\nmissing = [0.0]  # a zero says no more than that it is small"
    )
    yield channel.finding("dead-band", "warning", text, (), remedy)


def _own_noise(values: FloatArray, width: float) -> float:
    """Usual bend of samples outside of the band, as noise; 0 with few of them."""
    inside = np.abs(values) < width
    bends = np.abs(np.diff(values, 2))[~(inside[:-2] | inside[1:-1] | inside[2:])]
    return float(np.median(bends)) / (0.67449 * np.sqrt(6.0)) if bends.size else 0.0
