"""A time axis in another unit than it is said to be in: what a drive cannot do in that time tells.

The stamps alone say little: a sampling step of 1 s is one as good as 1 ms. A speed that is the derivative of a position
in no other unit, a shaft that takes a minute to follow a jump of its command, or a bearing sampled at a megahertz,
do. The limits are those of electromechanical drives, from a voice coil to a crane.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from thsa_cosim.errors import UnitError
from thsa_cosim.inspection.channel import Channel
from thsa_cosim.inspection.finding import Finding
from thsa_cosim.units import same_dimension

_SLOWEST, _FASTEST = 5.0, 1e-4
"""s that a drive takes at most, and a mass at least, to do 63 % of what a jump of its command asks for."""
_RARE, _DENSE = 10.0, 2e-6
"""s between samples of a drive's speed or current that nobody chooses."""
_COUNTED = 0.5
"""s between stamps that are whole numbers, from which on they may count samples or milliseconds."""
_LEAST_JUMPS, _CLEAR = 3, 10.0
"""Jumps that have to agree, and σ that each of them has to move the signal by."""
_FIRST_DAY, _LAST_DAY = 36_000.0, 60_000.0
"""Days since 1899-12-30 of the years 1998 to 2064."""
_MECHANICAL = ("m/s", "rad/s", "m", "rad")
_ELECTRICAL = ("A", "V")
_WARMED = 2.5
"""K: so much takes its time."""


def time_unit(recording: str, channels: Sequence[Channel]) -> Iterator[Finding]:
    """Yield the finding that time is in another unit, by what the ``channels`` of a recording do in it."""
    mechanical = [c for c in channels if _is(c, _MECHANICAL) and c.step > 0.0]
    drive = mechanical + [c for c in channels if _is(c, _ELECTRICAL) and c.step > 0.0]
    if not drive:
        return
    doubt = _by_jumps(channels, mechanical) or _by_samples(drive, mechanical) or _by_counting(channels, drive)
    if doubt is None:
        return
    text, unit = doubt
    remedy = f'[recordings.time]\nunit = "{unit}"' if unit else ""
    yield Finding(recording, "time", "unit", "warning", text, (), remedy)


def _is(channel: Channel, units: Sequence[str]) -> bool:
    try:
        return channel.unit not in ("", "1") and any(same_dimension(channel.unit, u) for u in units)
    except UnitError:
        return False


def _by_jumps(channels: Sequence[Channel], mechanical: Sequence[Channel]) -> tuple[str, str] | None:
    """How long speeds take to follow jumps of commands."""
    for command in channels:
        jumps = command.jumps if command.role != "output" else np.empty(0)
        for channel in mechanical if jumps.size >= _LEAST_JUMPS else ():
            if channel is command or channel.silent or not (_is(channel, ("m/s", "rad/s"))):
                continue
            taken = [t for a, b in _windows(jumps, channel) if (t := _settling(channel, a, b)) is not None]
            if len(taken) < _LEAST_JUMPS:
                continue
            usual = float(np.median(taken))
            text = f"{channel.name} takes {usual:.3g} s to follow the jumps of {command.name}"
            if usual > _SLOWEST:
                return f"{text}, and no drive is so slow: time seems to be in ms or us, not s", _smaller(
                    usual
                )
            if usual < _FASTEST:
                return f"{text}, and no mass is so fast: time seems to be in s, and is read as less", "s"
    return None


def _windows(
    jumps: np.ndarray[tuple[int], np.dtype[np.float64]], channel: Channel
) -> list[tuple[float, float]]:
    ends = np.append(jumps[1:], channel.time[-1])
    return [(float(a), float(b)) for a, b in zip(jumps, ends, strict=True)]


def _settling(channel: Channel, start: float, stop: float) -> float | None:
    """s from ``start`` until the channel has done 63 % of what it does until ``stop``; None if that is not clear."""
    first, last = np.searchsorted(channel.time, (start, stop))
    values = channel.clean[first:last]
    before = channel.clean[max(0, first - 10) : first]
    if values.size < 20 or before.size < 3:
        return None
    rest, end = float(np.median(before)), float(np.median(values[-values.size // 5 :]))
    if abs(end - rest) < _CLEAR * max(channel.noise, channel.quantum):
        return None
    done = np.flatnonzero((values - rest) / (end - rest) > 0.632)
    # Within two samples it is the sampling that is seen.
    return float(channel.time[first + done[0]] - start) if done.size and done[0] > 2 else None


def _smaller(seconds: float) -> str:
    """The unit in which a time of a few milliseconds to seconds is written as that many seconds."""
    return "ms" if seconds < 2e3 * _SLOWEST else "us"


def _by_samples(drive: Sequence[Channel], mechanical: Sequence[Channel]) -> tuple[str, str] | None:
    """Sampling steps that nobody chooses for a drive."""
    step, name = max(c.step for c in drive), drive[0].name
    if step > _RARE:
        return f"samples of {name} are {step:.4g} s apart: time seems to be in ms or us, not s", _smaller(
            step
        )
    dense = [c for c in mechanical if c.step < _DENSE and c.values.size >= 100]
    if dense:
        name, step = dense[0].name, dense[0].step
        if _FIRST_DAY < dense[0].time[0] < _LAST_DAY:
            return (
                f"time begins at {dense[0].time[0]:.6g}, a day's number in a spreadsheet: it is in days, not s",
                "d",
            )
        rate = f"samples of {name} are {step:.3g} s apart ({1e-6 / step:.3g} MHz)"
        return (
            f"{rate}, {np.ptp(dense[0].time):.3g} s in all: time seems to be in s, and is read as less",
            "s",
        )
    return None


def _by_counting(channels: Sequence[Channel], drive: Sequence[Channel]) -> tuple[str, str] | None:
    """Stamps that count."""
    channel = drive[0]
    time, step = channel.time, channel.step
    counts = time - time[0]
    if (
        step < _COUNTED
        or time.size < 100
        or np.max(np.abs(counts - np.round(counts))) > 1e-6 * np.max(counts)
    ):
        return None
    warm = [c for c in channels if _is(c, ("K",)) and float(np.ptp(c.clean)) > _WARMED + 8.0 * c.noise]
    if warm:
        return None
    hours = f"{np.ptp(time):.4g} s ({np.ptp(time) / 3600.0:.2g} h)"
    return (
        f"stamps are whole numbers, {step:g} apart, which makes {hours}: do they count ms, or samples?",
        "ms",
    )
