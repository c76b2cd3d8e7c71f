"""What only several channels together tell: a response before its command, slips of units, signs.

Only what must hold on any machine is used: a response cannot come before its command; a speed that is commanded and
the same speed as measured agree in the end; a speed is the derivative of its position.
"""

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from thsa_cosim.errors import UnitError
from thsa_cosim.inspection.channel import Channel, correlation
from thsa_cosim.inspection.finding import Finding
from thsa_cosim.recordings.outliers import running_median
from thsa_cosim.signals import FloatArray
from thsa_cosim.units import same_dimension

SLIPS: dict[str, float] = {
    "rpm for rad/s": 30.0 / np.pi,
    "rad/s for rpm": np.pi / 30.0,
    "degrees for radians": 180.0 / np.pi,
    "radians for degrees": np.pi / 180.0,
    "thousandths (mm, mA, ms)": 1e3,
    "thousands (km, kN, kV)": 1e-3,
    "per cent": 100.0,
    "a share for per cent": 0.01,
    "turns for radians": 1.0 / (2.0 * np.pi),
    "radians for turns": 2.0 * np.pi,
    "peak for RMS": np.sqrt(2.0),
    "RMS for peak": 1.0 / np.sqrt(2.0),
    "minutes for seconds": 1.0 / 60.0,
    "seconds for minutes": 60.0,
}
"""What is written for what is meant, and the factor on the numbers."""
_GEARS = frozenset(n for n, f in SLIPS.items() if f in (1e3, 1e-3, 100.0, 0.01, 60.0, 1.0 / 60.0))
"""Factors that a gear may have just as well, between two angles."""
_TIMES = {1e-3: "ms", 1e-6: "us", 60.0: "min", 1e3: "s"}
"""A speed in derivatives of its position, and the unit of time that makes them one; the last: time was read in ms."""
_NEAR = 0.02
"""Relative distance at which a factor is taken for a slip."""
_ONSET = 6.0
"""σ by which a response has to have moved."""
_LEAST_STEPS = 3
_ALIKE = 0.98
"""Correlation of two channels that are one quantity."""


def across_findings(channels: Sequence[Channel]) -> Iterator[Finding]:
    """Yield what is wrong between ``channels`` of one recording."""
    commands = [c for c in channels if c.role != "output" and c.silent and not c.averaged and _moves(c)]
    measured = [c for c in channels if c.role != "input" and not c.silent and _moves(c)]
    for command in commands:
        yield from _early_response(command, measured)
    pairs: list[list[Finding]] = []
    named: set[str] = set()
    for command in commands:
        for channel in measured:
            if _one_dimension(command, channel):
                pairs.append(list(_slip(command, channel)))
                named |= {name for f in pairs[-1] for name in (channel.name, command.name)}
    for position in channels:
        for speed in channels:
            if position is not speed and speed.name not in named and _is_derivative(position, speed):
                pairs += [list(_derivative(position, speed))]
    yield from _blamed([pair for pair in pairs if pair])


def _blamed(pairs: Sequence[Sequence[Finding]]) -> Iterator[Finding]:
    """The findings on pairs of channels, either of which may be wrong: one that is in several of them is."""
    often = Counter(name for pair in pairs for name in {f.channel for f in pair})
    told: set[tuple[str, str]] = set()
    for pair in pairs:
        most = max(often[f.channel] for f in pair)
        for finding in pair:
            if often[finding.channel] == most and (finding.channel, finding.kind) not in told:
                told.add((finding.channel, finding.kind))
                yield finding


def slip(factor: float, near: float = _NEAR) -> str | None:
    """Return which slip of units multiplies numbers by ``factor``, to a share of ``near``; None if none does."""
    for name, value in SLIPS.items():
        if abs(factor / value - 1.0) < near:
            return name
    return None


def _moves(channel: Channel) -> bool:
    return channel.range > 0.0 and channel.values.size >= 100


def _one_dimension(a: Channel, b: Channel) -> bool:
    try:
        return a.unit not in ("", "1") and b.unit not in ("", "1") and same_dimension(a.unit, b.unit)
    except UnitError:
        return False


def _early_response(command: Channel, measured: Sequence[Channel]) -> Iterator[Finding]:
    """A response that begins before the command does: the command's stamps are late, or the response's early."""
    starts = _onsets(command)
    if starts.size < _LEAST_STEPS:
        return
    leads: dict[str, float] = {}
    for channel in measured:
        times = [_response(channel, float(command.time[k - 1]), float(command.time[k])) for k in starts]
        early = np.array([t for t in times if t is not None])
        if early.size >= _LEAST_STEPS and np.mean(early > 3.0 * channel.step) > 0.8:
            leads[channel.name] = float(np.median(early))
    if not leads:
        return
    lead = float(np.median(list(leads.values())))
    who = " and ".join(leads)
    verb = "answers" if len(leads) == 1 else "answer"
    text = f"{who} {verb} {1e3 * lead:.3g} ms before {command.name} changes, which is at least so late"
    remedy = f"[recordings.columns.{command.name}]\nshift = {-lead:.4g}"
    if len(leads) > 1 or len(measured) == 1:
        yield command.finding("delay", "warning", text, (), remedy)
    else:
        name = next(iter(leads))
        channel = next(c for c in measured if c.name == name)
        text = f"{name} answers {1e3 * lead:.3g} ms before {command.name} changes, no other signal does"
        yield channel.finding(
            "delay", "warning", text, (), f"[recordings.columns.{name}]\nshift = {lead:.4g}"
        )


def _onsets(command: Channel) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Samples at which the command begins to change after a rest of at least 50 samples."""
    changes = np.flatnonzero(np.diff(command.plain) != 0.0) + 1
    if changes.size == 0:
        return changes
    rest = np.diff(np.concatenate(([0], changes)))
    return changes[rest >= 50]


def _response(channel: Channel, before: float, start: float) -> float | None:
    """s by which the channel moves ahead of ``start``; None if it was not at rest before, or does not answer."""
    window = 50.0 * channel.step
    inside = (channel.time >= before - window) & (channel.time <= start + window)
    time, values = channel.time[inside], channel.clean[inside]
    calm = time < before - 0.6 * window
    if np.sum(calm) < 10 or np.sum(inside) < 30:
        return None
    rest, noise = float(np.mean(values[calm])), max(channel.noise, channel.quantum)
    if float(np.std(values[calm])) > 1.6 * noise:
        return None  # it moves anyway
    smooth = running_median(values, 3)
    moved = np.abs(smooth - rest) > _ONSET * noise
    # From the first sample on after which it stays away.
    away = np.flatnonzero(moved[:-2] & moved[1:-1] & moved[2:])
    if away.size == 0:
        return None
    return start - float(time[away[0]])


def _slip(command: Channel, channel: Channel) -> Iterator[Finding]:
    """Whether a measured channel is its command times a factor that units are confused by."""
    if not np.array_equal(command.time, channel.time):
        return
    a, b = command.clean, channel.clean
    if abs(correlation(a, b)) < 0.9:
        return
    factor = _ratio(a, b)
    if factor is None:
        return
    yield from _named(channel, factor, f"its command {command.name}", command)


def _ratio(a: FloatArray, b: FloatArray) -> float | None:
    """Median of b / a where a is large and both are settled."""
    settled = np.abs(a) > 0.3 * float(np.max(np.abs(a)))
    changes = np.abs(np.gradient(a)) <= 1e-9 * float(np.max(np.abs(a)))
    # "same" would be as long as the window where that is longer than the recording.
    calm = settled & np.asarray(np.convolve(changes, np.ones(101))[50:-50] > 100.5)
    used = calm if np.sum(calm) > 50 else settled
    ratios = b[used] / a[used]
    if ratios.size < 20:
        return None
    low, middle, high = np.quantile(ratios, (0.25, 0.5, 0.75))
    return float(middle) if high - low < 0.2 * abs(middle) else None


def _named(channel: Channel, factor: float, words: str, other: Channel) -> Iterator[Finding]:
    """A slip of ``channel`` against ``other``, in ``words``: which of the two is wrong, they do not tell."""
    sign = factor < 0.0
    name = slip(abs(factor))
    if name in _GEARS and same_dimension(channel.unit, "rad/s"):
        name = None
    turn = -1.0 if sign else 1.0
    if name is not None:
        back = slip(1.0 / abs(factor)) or name
        text = f"{channel.name} is {abs(factor):.4g} times {words}: {name}, unless {other.name} is wrong"
        remedy = f"[recordings.columns.{channel.name}]\nscale = {turn / SLIPS[name]:.9g}"
        yield channel.finding("unit", "error", text, (), remedy)
        text = (
            f"{words} is {1.0 / abs(factor):.4g} times {channel.name}: {back}, unless {channel.name} is wrong"
        )
        remedy = f"[recordings.columns.{other.name}]\nscale = {turn * SLIPS[name]:.9g}"
        yield other.finding("unit", "error", text, (), remedy)
    if sign:
        for one, against in ((channel, words), (other, channel.name)):
            text = f"{one.name} runs against {against}: one of the two has the wrong sign"
            remedy = f"[recordings.columns.{one.name}]\nscale = -1"
            yield one.finding("sign", "error", text, (), remedy)


def _is_derivative(position: Channel, speed: Channel) -> bool:
    try:
        return any(
            same_dimension(position.unit, p) and same_dimension(speed.unit, s)
            for p, s in (("m", "m/s"), ("rad", "rad/s"))
            if position.unit not in ("", "1") and speed.unit not in ("", "1")
        )
    except UnitError:
        return False


def _derivative(position: Channel, speed: Channel) -> Iterator[Finding]:
    """Whether the speed is the derivative of the position, as far as one machine has one speed."""
    if not np.array_equal(position.time, speed.time) or position.averaged or speed.averaged:
        return
    from thsa_cosim.units import conversion

    factor = conversion(speed.unit, "m/s" if same_dimension(speed.unit, "m/s") else "rad/s")[0]
    factor /= conversion(position.unit, "m" if same_dimension(position.unit, "m") else "rad")[0]
    time = position.time
    travelled = (
        np.concatenate(([0.0], np.cumsum(0.5 * (speed.clean[1:] + speed.clean[:-1]) * np.diff(time))))
        * factor
    )
    moved = position.clean - position.clean[0]
    # Over stretches, not from the start: an offset of the speed would grow with time.
    width = max(10, time.size // 50)
    a, b = travelled[width:] - travelled[:-width], moved[width:] - moved[:-width]
    power = float(np.sum(a * a))
    if power <= 0.0 or float(np.ptp(moved)) < 20.0 * max(position.noise, position.quantum):
        return
    correlation = float(np.sum(a * b) / np.sqrt(power * np.sum(b * b)))
    if abs(correlation) < _ALIKE:
        return  # the speed of another part
    ratio = float(np.sum(a * b)) / float(np.sum(b * b))
    if abs(ratio - 1.0) < _SAME_SPEED:
        return
    yield from _named(speed, ratio, f"the derivative of {position.name}", position)
    for factor, unit in _TIMES.items():
        if abs(ratio / factor - 1.0) < _NEAR:
            text = f"{speed.name} is {ratio:.4g} times the derivative of {position.name}: time seems to be in {unit}"
            remedy = f'[recordings.time]\nunit = "{unit}"'
            yield Finding(
                speed.recording, "time", "unit", "error", f"{text}, unless one of them is wrong", (), remedy
            )


_SAME_SPEED = 0.05
