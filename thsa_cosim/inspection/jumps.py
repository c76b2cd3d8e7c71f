"""Jumps that no machine makes: a counter that wraps, a tare, a range or a sign that is switched, joined recordings.

What a shaft or a winding does, it does over some samples. A jump is a change between two samples that is many times
larger than any other one of the recording, and no answer to a command.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.inspection.channel import Channel
from thsa_cosim.inspection.finding import Finding, Span

_LARGER, _NOISES, _STEPS = 6.0, 10.0, 4.0
"""Times the largest usual change, σ and quantisation steps that a jump exceeds."""
_SHARE = 0.03
"""Of the range, at least."""
_MOST, _MOST_WRAPS = 0.004, 0.05
"""Share of samples; a signal that jumps more often does so by itself, or is a command."""
_ALIKE, _BACK = 0.08, 0.35
"""By how much wraps differ, and the share of a burst's jump that may be left after it."""
_ALONE = 0.35
"""Change before and after a jump, in jumps."""
_AROUND, _MANY = 12, 4
"""Samples before and after a wrap that show how the signal moves; so many wraps of one size are no chance."""
_STAY = 5
"""Samples on the other side of a border that no spike stays there; hopping on it, one in 32 of the stays is as long."""
_MOVES_ON = 4.0
"""σ by which it moves within them."""
_BURST = 40
"""Samples within which a signal that jumps back was disturbed; after more, it was switched."""


def jumps(channel: Channel) -> Iterator[Finding]:
    """Wraps of a counter or an angle, bursts that spikes are too short for, and steps from one sample to the next."""
    if (channel.role == "input" and (channel.held or channel.silent or channel.drawn)) or channel.averaged:
        return
    at = _jumps(channel, channel.plain, _MOST_WRAPS)  # at rest on the border it hops to and fro
    period = wrap_period(channel, at) if at.size else None
    if period is not None:
        yield _wrapped(channel, at, period)
        return
    at = _jumps(channel, channel.clean, _MOST)
    sizes = channel.clean[at + 1] - channel.clean[at]
    bursts, steps = _paired(channel, at, sizes)
    if channel.shared is not None:
        steps = [k for k in steps if not np.isin(channel.time[k + 1], channel.shared)]
    if bursts:
        spans = tuple((float(channel.time[a + 1]), float(channel.time[b])) for a, b in bursts)
        longest = max(b - a for a, b in bursts)
        text = (
            f"{channel.name} jumps away and back {len(bursts)} time{'s' if len(bursts) > 1 else ''},"
            f" for up to {longest} samples: it was disturbed"
        )
        pairs = ", ".join(f"[{a:.6g}, {b:.6g}]" for a, b in spans[:40])
        remedy = f"[recordings.columns.{channel.name}]\nmask = [{pairs}]"
        yield channel.finding("spikes", "warning", text, spans[:40], remedy)
    if steps:
        where: tuple[Span, ...] = tuple((float(channel.time[k]), float(channel.time[k + 1])) for k in steps)
        largest = max(steps, key=lambda k: abs(channel.clean[k + 1] - channel.clean[k]))
        size = channel.number(float(channel.clean[largest + 1] - channel.clean[largest]))
        times = f", and {len(steps) - 1} more" if len(steps) > 1 else ""
        text = (
            f"{channel.name} jumps by {size} from one sample to the next at {channel.time[largest]:.4g} s{times}:"
            " a tare, a range or sign that was switched, joined recordings, or something that broke"
        )
        yield channel.finding("step", "warning", text, where[:40])


def jump_times(channel: Channel) -> NDArray[np.float64]:
    """Times in s after jumps of a channel that is no command: a load that is switched, a motion that is imposed."""
    at = _jumps(channel, channel.plain, _MOST_WRAPS)
    return np.asarray(channel.time[at + 1])


def _jumps(channel: Channel, values: NDArray[np.float64], most: float) -> NDArray[np.intp]:
    """Indices k of jumps of (n,) ``values`` from sample k to sample k + 1, none if more than ``most`` of them jump."""
    change = np.abs(np.diff(values))
    if change.size < 100 or channel.range <= 0.0:
        return np.empty(0, dtype=np.intp)
    answer = channel.answers[1:] | channel.answers[:-1]
    usual = float(np.quantile(change[~answer], 1.0 - most)) if np.sum(~answer) > 100 else np.inf
    noise = 0.0 if channel.silent else channel.noise
    limit = max(_LARGER * usual, _NOISES * noise, _STEPS * channel.quantum, _SHARE * channel.range)
    # What is fast goes on for a sample or two; what is switched does not.
    beside = np.maximum(np.append(change[1:], 0.0), np.append(0.0, change[:-1]))
    alone = (beside < _ALONE * change) | (most > _MOST)
    found = np.flatnonzero((change > limit) & alone & ~answer)
    return found if found.size <= most * change.size else np.empty(0, dtype=np.intp)


def wrap_period(channel: Channel, at: NDArray[np.intp]) -> float | None:
    """Return by how much the value starts again, if all jumps are alike and as large as the range; else None."""
    values = channel.plain
    sizes = values[at + 1] - values[at]
    period, span = float(np.median(np.abs(sizes))), float(np.ptp(values))
    if not period > 0.8 * span or np.max(np.abs(np.abs(sizes) - period)) > _ALIKE * period:
        return None
    # What wraps moves on across the border, against the jump; a sign or a block that is switched does not.
    before = np.array([_slope(values[max(0, k - _AROUND) : k + 1]) for k in at])
    after = np.array([_slope(values[k + 1 : k + 2 + _AROUND]) for k in at])
    across = bool(np.all(before * sizes < 0.0) and np.all(after * sizes < 0.0))
    # At rest it is noise that has a slope, and against a single jump as often as not.
    moves = np.minimum(np.abs(before), np.abs(after)) * _AROUND > _MOVES_ON * channel.noise
    across &= sizes.size > 2 or bool(np.all(moves))
    at_ends = np.ptp(np.minimum(values[at], values[at + 1])) < 2.0 * _ALIKE * period
    return period if at_ends and (across or (sizes.size >= _MANY and _stays(values))) else None


def _stays(values: NDArray[np.float64]) -> bool:
    """Whether (n,) ``values`` stay in either half of their range for longer than a spike does."""
    upper = values > 0.5 * (values.max() + values.min())
    lengths = np.diff(np.concatenate(([0], np.flatnonzero(np.diff(upper)) + 1, [values.size])))
    return bool(min(lengths[::2].max(), lengths[1::2].max(initial=0)) >= _STAY)


def _slope(values: NDArray[np.float64]) -> float:
    """Usual change from sample to sample."""
    return float(values[-1] - values[0]) / (values.size - 1) if values.size > 1 else 0.0


def _wrapped(channel: Channel, at: NDArray[np.intp], period: float) -> Finding:
    known = {"rad": 2.0 * np.pi, "deg": 360.0, "1": 65536.0}.get(channel.unit, 0.0)
    exact = known if known and abs(period / known - 1.0) < 2.0 * _ALIKE else period
    number = channel.number(exact)
    text = (
        f"{channel.name} starts again {at.size} time{'s' if at.size > 1 else ''} by about {number},"
        " from one sample to the next: a counter or an angle that wraps"
    )
    where = tuple((float(channel.time[k]), float(channel.time[k + 1])) for k in at[:40])
    remedy = f"[recordings.columns.{channel.name}]\nunwrap = {exact:.6g}  # in {channel.unit}, once you know it exactly"
    return channel.finding("wrapped", "error", text, where, remedy)


def _paired(
    channel: Channel, at: NDArray[np.intp], sizes: NDArray[np.float64]
) -> tuple[list[tuple[int, int]], list[int]]:
    """Jumps that are undone within some samples, as (first, last) index, and those that stay."""
    bursts, steps, k = [], [], 0
    while k < at.size:
        after = k + 1
        if after < at.size and at[after] - at[k] <= _BURST and sizes[k] * sizes[after] < 0.0:
            apart = abs(float(channel.clean[at[after] + 1] - channel.clean[at[k]]))
            if apart < _BACK * abs(float(sizes[k])):
                bursts.append((int(at[k]), int(at[after])))
                k += 2
                continue
        steps.append(int(at[k]))
        k += 1
    return bursts, steps
