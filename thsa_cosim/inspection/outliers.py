"""Single samples and short stretches that fall out of their neighbourhood: spikes and drop-outs."""

from collections.abc import Iterator

import numpy as np

from thsa_cosim.inspection.channel import Channel, share
from thsa_cosim.inspection.finding import Finding, Severity
from thsa_cosim.inspection.samples import coded
from thsa_cosim.recordings.noise import RESTING
from thsa_cosim.recordings.outliers import Mask

_FALL = 8.0
"""σ by which a signal has to fall into a drop-out and rise out of it."""
_SAME = 0.6
"""Share of the outliers that have one value if they are drop-outs."""
_OFF = 0.3
"""Share of the range of everything else, by which a level that keeps coming back is off it."""
_FEW = 3
_MANY, _LARGE, _LARGE_SHARE = 5, 12.0, 0.05
"""Spikes, or the σ or share of the range of their usual size, from which on they are a warning."""


def outliers(channel: Channel) -> Iterator[Finding]:
    """Spikes and drop-outs, told apart by whether they fall on one value."""
    if channel.silent or channel.averaged:
        return
    dropped, level = _dropouts(channel)
    remedy = f"[recordings.columns.{channel.name}]\ndespike = true"
    count = int(np.sum(dropped))
    if count and _beyond(channel, level):
        yield coded(channel, dropped)
    elif count:
        part = share(count / dropped.size)
        text = f"{channel.name} drops to {channel.number(level)} and back: {count} samples ({part})"
        yield channel.finding("dropouts", "warning", text, channel.spans(dropped), remedy)
    spikes = channel.spikes & ~dropped
    count = int(np.sum(spikes))
    if count:
        size = float(np.median(np.abs(channel.plain - channel.clean)[spikes]))
        part, plural = share(count / spikes.size), "s" if count > 1 else ""
        text = f"{count} spike{plural} ({part}), typically of {channel.number(size)}"
        sure = size > _LARGE * channel.noise or (channel.steady and count >= _MANY)
        if not channel.steady:  # what jumps by itself has no usual noise to fall out of
            sure &= size > _LARGE_SHARE * channel.range
        severity: Severity = "warning" if sure else "note"
        yield channel.finding("spikes", severity, text, channel.spans(spikes), remedy)


def _beyond(channel: Channel, level: float) -> bool:
    """Whether ``level`` lies off everything else that the channel gives: a code of its logger, no lost signal."""
    others = channel.plain[channel.plain != level]
    return level != 0.0 and max(level - others.max(), others.min() - level) > _OFF * float(np.ptp(others))


def _dropouts(channel: Channel) -> tuple[Mask, float]:
    """Which samples fell to one value that keeps coming back, and that value."""
    values, noise = channel.plain, channel.noise
    starts, lengths = channel.runs
    inner = slice(1, -1)
    first, length = starts[inner], lengths[inner]
    before, after = values[first - 1], values[np.minimum(first + length, values.size - 1)]
    level = values[first]
    into, out = level - before, after - level
    # Down and up again, to about where it was; the signal may have moved on a little meanwhile.
    fell = (np.abs(into) > _FALL * noise) & (np.abs(out) > _FALL * noise) & (into * out < 0.0)
    fell &= (np.abs(after - before) < 0.5 * np.abs(into)) & (length < 20 * RESTING)
    mask = np.zeros(values.shape, dtype=np.bool_)
    if not channel.steady:
        fell &= level == 0.0  # a signal that jumps by itself may well come back to a limit
    if np.sum(fell) < _FEW:
        fell &= length >= _FEW  # a single stretch of one value, longer than a spike
    if not fell.any():
        return mask, 0.0
    levels, counts = np.unique(level[fell], return_counts=True)
    usual = float(levels[np.argmax(counts)])
    if counts.max() < _SAME * np.sum(fell):
        return mask, 0.0
    if usual in (values.min(), values.max()) and counts.max() < _MANY:
        return mask, 0.0  # a limit that a signal swings against
    for a, n in zip(first[fell & (level == usual)], length[fell & (level == usual)], strict=True):
        mask[a : a + n] = True
    return mask, usual
