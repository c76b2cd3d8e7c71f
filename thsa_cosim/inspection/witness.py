"""What other channels of a recording say to a jump or a spike: more than one of them sees the machine's own events.

A force that an impact makes brakes the mass that it meets: the speed has a kink there (Newton). A current that jumps
when a controller leaves its dead band jumps with its voltage, and no shaft moves by a jump. A sensor's spike or tare is
its own; and where recordings are joined, positions and speeds jump, too.
"""

from collections.abc import Sequence

import numpy as np

from thsa_cosim.errors import UnitError
from thsa_cosim.inspection.channel import Channel
from thsa_cosim.inspection.jumps import jump_times
from thsa_cosim.signals import FloatArray
from thsa_cosim.units import same_dimension

_SPEEDS, _MOTION = ("m/s", "rad/s"), ("m/s", "rad/s", "m", "rad")
_SHARP = 8.0
"""σ by which the slope of a speed has to change."""
_RARE = 0.01
"""Share of the samples at which it changes most: a kink is no everyday's bend."""
_LIKE_NEXT = 2.5
"""Times the second largest change around a kink, that the largest one may be."""
_NEAR = 2.5
"""Samples within which two channels do the same."""


def with_witnesses(channels: Sequence[Channel]) -> list[Channel]:
    """The channels with the times of commands, impacts and jumps that others share: what happens there is no defect."""
    jumps = {c.name: c.jumps if c.jumps.size else jump_times(c) for c in channels if c.role != "output"}
    measured = [c for c in channels if c.role != "input" and not c.averaged and not c.silent]
    moving = [c for c in measured if _is(c, _MOTION)]
    kinks = {c.name: kink_times(c) for c in moving if _is(c, _SPEEDS)}
    shared = _shared_jumps([c for c in measured if not _is(c, _MOTION)], moving)
    found = []
    for channel in channels:
        others = [times for name, times in jumps.items() if name != channel.name or channel.jumps.size]
        if not _is(channel, _MOTION):
            others += list(kinks.values())
        times = np.unique(np.concatenate([np.empty(0), *others]))
        both = shared.get(channel.name, np.empty(0))
        found.append(channel.with_events(times, both) if times.size or both.size else channel)
    return found


def kink_times(speed: Channel) -> FloatArray:
    """Times in s at which the slope of a measured speed changes at once, and the speed does not: something was hit."""
    values = speed.clean
    if values.size < 100:
        return np.empty(0)
    bends = np.abs(values[4:] - 2.0 * values[2:-2] + values[:-4])
    limit = max(
        _SHARP * np.sqrt(6.0) * max(speed.noise, speed.quantum), float(np.quantile(bends, 1.0 - _RARE))
    )
    # What jumps away and back, or for good, is the speed's own defect.
    steep = np.sort(np.abs(np.lib.stride_tricks.sliding_window_view(np.diff(values), 4)), axis=1)
    goes_on = steep[:, 3] < _LIKE_NEXT * steep[:, 2]
    spiking = np.convolve(speed.spikes, np.ones(7), "same")[2:-2] > 0.0
    return np.asarray(speed.time[1:-3][(bends > limit) & goes_on & ~spiking])


def _shared_jumps(efforts: Sequence[Channel], moving: Sequence[Channel]) -> dict[str, FloatArray]:
    """Times in s at which a current, voltage or force jumps with one of another dimension, while all motion goes on."""
    if not moving:
        return {}
    times = {c.name: jump_times(c) for c in efforts}
    jumping = np.concatenate([jump_times(c) for c in moving])
    found = {}
    for channel in efforts:
        others = [times[c.name] for c in efforts if not _alike(c, channel)]
        near = _NEAR * channel.step
        both = _close(times[channel.name], np.concatenate([np.empty(0), *others]), near)
        found[channel.name] = times[channel.name][both & ~_close(times[channel.name], jumping, near)]
    return found


def _close(times: FloatArray, others: FloatArray, near: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Which of (n,) ``times`` have one of (m,) ``others`` within ``near`` s."""
    if not others.size:
        return np.zeros(times.shape, dtype=np.bool_)
    return np.asarray(np.min(np.abs(times[:, None] - others), axis=1, initial=np.inf) <= near)


def _alike(a: Channel, b: Channel) -> bool:
    try:
        return a.unit == b.unit or "1" in (a.unit, b.unit) or same_dimension(a.unit, b.unit)
    except UnitError:
        return True


def _is(channel: Channel, units: Sequence[str]) -> bool:
    try:
        return channel.unit not in ("", "1") and any(same_dimension(channel.unit, u) for u in units)
    except UnitError:
        return False
