"""Stretches in which a channel does not measure: clipped, stuck, copied from elsewhere."""

from collections.abc import Iterator

import numpy as np

from thsa_cosim.inspection.channel import Channel, share
from thsa_cosim.inspection.finding import Finding, Severity
from thsa_cosim.recordings.noise import RESTING, white_noise
from thsa_cosim.recordings.outliers import Mask
from thsa_cosim.signals import FloatArray

_PILE = 8.0
"""So many times more samples lie on a limit than on the busiest level next to it."""
_LEAST_CLIPPED = 8
_COMMANDED = 3e-4
"""Noise of an input, in shares of its range, below which it is a command rather than measured."""
_HOPS = 8
"""Short stays at a limit that make it one."""
_LEAST_STUCK = 40.0
_LEAVES, _LEAVES_SHARE = 10.0, 0.05
"""σ and share of the range by which what was stuck has moved meanwhile; what was clipped comes back over its limit."""
_MUCH, _OFTEN = 0.1, 5
"""Independent samples of one value, share of the recording that is an error, stretches that are no defect."""


def clipped(channel: Channel) -> Iterator[Finding]:
    """Samples that pile up on the largest or smallest value: beyond it, the sensor did not see."""
    if channel.silent or channel.averaged:
        return
    if channel.role == "input" and (not channel.steady or channel.noise < _COMMANDED * channel.range):
        return  # a command stays where it is told to
    values = channel.clean[channel.fresh_index]
    broken = stuck_mask(channel)
    limits = [
        limit
        for limit in (float(values.max()), float(values.min()))
        if _piles_up(values, limit, channel) and not np.all(broken[channel.plain == limit])
    ]
    if not limits:
        return
    mask = np.isin(channel.clean, limits)
    at = " and ".join(channel.number(limit) for limit in sorted(limits))
    text = f"{channel.name} is clipped at {at}: {int(np.sum(mask))} samples ({share(float(np.mean(mask)))})"
    remedy = f"[recordings.columns.{channel.name}]\n" + "\n".join(
        f"{'above' if limit == limits[0] and limit == float(values.max()) else 'below'} = {limit!r}"
        for limit in limits
    )
    yield channel.finding("clipped", "warning", text, channel.spans(mask), remedy)


def _piles_up(values: FloatArray, limit: float, channel: Channel) -> bool:
    """Whether more samples lie on the limit, one after the other, than noise puts on any value next to it."""
    at = values == limit
    count = int(np.sum(at))
    if count < _LEAST_CLIPPED:
        return False
    noise = max(channel.noise, channel.quantum)
    near = values[(np.abs(values - limit) <= 3.0 * noise) & ~at]
    busiest = np.unique(near, return_counts=True)[1].max() if near.size else 0
    # Neighbours of a clipped sample are clipped, too; of an extreme of noise they are not.
    together = float(np.mean(at[1:][at[:-1]])) if at[:-1].any() else 0.0
    longer = count > 2.0 * busiest and together > 0.5 and count > 3 * _LEAST_CLIPPED
    # Noise about the limit itself: every second sample is clipped.
    dithered = count > 3.0 * busiest and together > 0.25 and channel.noise > 2.0 * channel.quantum
    if count <= _PILE * busiest and not longer and not dithered:
        return False
    return (
        channel.steady or _runs_into(values, at, channel.quantum) or _cut_noise(values, at, channel.quantum)
    )


def _cut_noise(values: FloatArray, at: Mask, quantum: float) -> bool:
    """Whether noise hops onto the limit and off it, as noise that is cut does, and what comes to rest does not."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], at, [False]))))
    lengths = edges[1::2] - edges[::2]
    noise = white_noise(values[~at]) if np.sum(~at) >= 100 else 0.0
    return bool(np.sum(lengths <= 3) >= max(_HOPS, 0.2 * lengths.size) and noise > 2.0 * quantum)


def _runs_into(values: FloatArray, at: Mask, quantum: float) -> bool:
    """Whether the signal runs into its limit at speed, more than once: what comes to rest slows down before."""
    entries = np.flatnonzero(at[3:-1] & ~at[2:-2] & at[4:]) + 3
    speed = np.abs(values[entries] - values[entries - 2]) / 2.0
    return entries.size >= 2 and float(np.median(speed)) > max(3.0 * quantum, 0.01 * float(np.ptp(values)))


def stuck(channel: Channel) -> Iterator[Finding]:
    """A sensor with noise that gives one value for longer than its noise allows."""
    mask = stuck_mask(channel)
    if not mask.any():
        return
    spans = channel.spans(mask, 1)
    part = float(np.mean(mask))
    text = f"{channel.name} gives one value for {share(part)} of the recording, without the noise that it has elsewhere"
    pairs = ", ".join(f"[{a:.6g}, {b:.6g}]" for a, b in spans)
    remedy = f"[recordings.columns.{channel.name}]\nmask = [{pairs}]"
    severity: Severity = "error" if part > _MUCH else "warning"
    if len(spans) > _OFTEN:  # a supply that is quiet, say, while the drive is off
        severity = "note"
    yield channel.finding("stuck", severity, text, spans, remedy)


def stuck_mask(channel: Channel) -> Mask:
    """Which samples belong to a run of one value that noise would have ended."""
    starts, lengths = channel.runs
    mask = np.zeros(channel.values.shape, dtype=np.bool_)
    if not channel.steady or channel.averaged:
        return mask
    period = channel.independence.period
    short = lengths < RESTING * period
    # How often a sample equals the one before, outside of the long runs: what noise and quantisation make of it.
    usual = int(np.sum(lengths[short]))
    if usual < 0.02 * channel.values.size or usual < 100:
        return mask
    repeats = min(0.9, 1.0 - float(np.sum(short)) * period / usual)
    limit = period * max(_LEAST_STUCK, 3.0 * np.log(channel.values.size) / -np.log(max(repeats, 0.05)))
    extremes = (channel.clean.min(), channel.clean.max())
    long = lengths > limit
    for first, length in zip(starts[long].tolist(), lengths[long].tolist(), strict=True):
        at_limit = channel.plain[first] in extremes and not _stays(channel, first, length)
        if not at_limit:
            mask[first : first + length] = True
    return mask


def _stays(channel: Channel, first: int, length: int) -> bool:
    """Whether a run on the largest or smallest value is no limit: the only one there, to the end or left by a jump."""
    values, after = channel.plain, first + length
    if np.sum(values == values[first]) > length:
        return False
    jump = max(_LEAVES * channel.noise, _LEAVES_SHARE * channel.range)
    return after == values.size or bool(abs(values[after] - values[first]) > jump)


def repeated(channel: Channel) -> Iterator[Finding]:
    """A stretch of noisy samples that occurs twice: a buffer written again."""
    if not channel.steady or channel.averaged:
        return
    values = channel.values[channel.fresh_index]
    time = channel.time[channel.fresh_index]
    # Wide patterns: so many samples in a row agree by chance once in a million recordings.
    equal = float(np.mean(np.diff(values) == 0.0))
    width = int(np.ceil((2.0 * np.log(values.size) + 14.0) / -np.log(min(max(equal, 0.05), 0.95))))
    if values.size < 4 * width:
        return
    windows = np.lib.stride_tricks.sliding_window_view(values, width)
    moving = np.sum(np.diff(windows, axis=1) != 0.0, axis=1) > 0.5 * width
    rows = np.ascontiguousarray(windows[moving]).view(np.dtype((np.void, values.itemsize * width))).ravel()
    _, first, counts = np.unique(rows, return_index=True, return_counts=True)
    if not (counts > 1).any():
        return
    twice = np.isin(rows, rows[first[counts > 1]])
    mask = np.zeros(values.shape, dtype=np.bool_)
    for k in np.flatnonzero(moving)[twice]:
        mask[k : k + width] = True
    where = channel.spans(np.isin(channel.time, time[mask]))
    text = (
        f"{channel.name} holds the same samples, noise included, more than once: {int(np.sum(mask))} samples"
    )
    yield channel.finding("repeated", "warning", text, where)
