"""Two signals that should be one quantity, and are so only in part: rectified, stuck, or exchanged with another column.

``across`` compares signals that do agree; here one of them follows the other but for its sign, or but for a while, or
another column follows it in its place.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from thsa_cosim.errors import UnitError
from thsa_cosim.inspection.channel import Channel, correlation
from thsa_cosim.inspection.finding import Finding, Severity
from thsa_cosim.recordings.outliers import Mask
from thsa_cosim.signals import FloatArray
from thsa_cosim.units import conversion, same_dimension

_ALIKE, _UNLIKE = 0.98, 0.7
"""Correlation of two signals that are one quantity, and that are not."""
_NEGATIVE = 0.05
"""Share of samples with the other sign that a signal has to have to be called signed."""
_STILL, _MOVED = 0.03, 0.1
"""Share of the recording without a change, and share of its range that the other signal moves meanwhile."""
_EQUAL = 0.05
"""How far from 1 the ratio of two signals may be that are exchanged."""


def pair_findings(channels: Sequence[Channel]) -> Iterator[Finding]:
    """Yield what pairs of ``channels`` of one recording tell that do not simply agree."""
    usable = [c for c in channels if c.values.size >= 100 and c.range > 0.0 and not c.averaged]
    commands = [c for c in usable if c.role != "output" and (c.silent or c.drawn)]
    measured = [c for c in usable if c.role != "input"]
    told: set[str] = set()
    for command in commands:
        for channel in measured:
            if channel.name in told or not _one(command, channel):
                continue
            for finding in _against(
                command.clean, channel.clean, channel, command, f"its command {command.name}"
            ):
                told.add(channel.name)
                yield finding
            if channel.name not in told:
                for finding in _exchanged(command, channel, [c for c in measured if c is not channel]):
                    told.add(channel.name)
                    yield finding
    for position in usable:
        for speed in usable:
            rate = _rate(position, speed)
            if rate is None or position.name in told or speed.name in told:
                continue
            for finding in _moved(position, speed, rate):
                told.add(finding.channel)
                yield finding


def _one(a: Channel, b: Channel) -> bool:
    """Whether two channels have one dimension and one time axis."""
    try:
        stated = a.unit not in ("", "1") and b.unit not in ("", "1")
        return stated and same_dimension(a.unit, b.unit) and np.array_equal(a.time, b.time)
    except UnitError:
        return False


def _correlation(a: FloatArray, b: FloatArray) -> float:
    return correlation(a, b) if a.size >= 50 else 0.0


def _signed(values: FloatArray) -> bool:
    """Whether both signs occur, and not by noise."""
    large = np.abs(values) > 0.1 * np.max(np.abs(values))
    return bool(_NEGATIVE < np.mean(values[large] < 0.0) < 1.0 - _NEGATIVE) if large.any() else False


def _against(
    expected: FloatArray, seen: FloatArray, channel: Channel, other: Channel, words: str
) -> Iterator[Finding]:
    """Whether ``seen`` (n,) is ``expected`` (n,) without its sign, or stays while the other moves."""
    if _signed(expected) and not _signed(seen) and _correlation(np.abs(expected), np.abs(seen)) > _ALIKE:
        text = (
            f"{channel.name} has one sign where {words} has both: its magnitude was recorded, not its value"
        )
        yield channel.finding("sign", "error", text)
        return
    found = _still(channel, expected)
    if found is not None and _correlation(expected[~found], seen[~found]) > _ALIKE:
        yield _stuck(channel, found, other, "note")  # a machine may be blocked, too


def _still(channel: Channel, expected: FloatArray) -> Mask | None:
    """The samples (n,) of runs of one value during which ``expected`` (n,) moves; None without any."""
    starts, lengths = channel.runs
    mask = np.zeros(channel.values.shape, dtype=np.bool_)
    span = float(np.ptp(expected))
    for first, length in zip(starts.tolist(), lengths.tolist(), strict=True):
        if length < max(40, _STILL * mask.size):
            continue
        if float(np.ptp(expected[first : first + length])) > _MOVED * span:
            mask[first : first + length] = True
    return mask if mask.any() else None


def _stuck(channel: Channel, mask: Mask, other: Channel, severity: Severity = "error") -> Finding:
    spans = channel.spans(mask, 1)
    pairs = ", ".join(f"[{a:.6g}, {b:.6g}]" for a, b in spans)
    text = f"{channel.name} keeps one value for {100.0 * np.mean(mask):.2g} % of the recording while {other.name} moves"
    remedy = f"[recordings.columns.{channel.name}]\nmask = [{pairs}]"
    return channel.finding("stuck", severity, text, spans, remedy)


def _exchanged(command: Channel, channel: Channel, others: Sequence[Channel]) -> Iterator[Finding]:
    """Whether another column follows the command in the place of the one that should."""
    if abs(_correlation(command.clean, channel.clean)) > _UNLIKE and 0.5 < abs(_gain(command, channel)) < 2.0:
        return
    for other in others:
        if other.clean.size != command.clean.size or _one(command, other):
            continue
        likeness = _correlation(command.clean, other.clean)
        if likeness > _ALIKE and abs(_gain(command, other) - 1.0) < _EQUAL:
            text = (
                f"{other.name} follows {command.name} as {channel.name} should: are their columns exchanged?"
            )
            yield channel.finding("unit", "error", text)
            return


def _gain(a: Channel, b: Channel) -> float:
    """How many times ``a``'s numbers ``b``'s are."""
    return float(np.sum(a.clean * b.clean)) / float(np.sum(a.clean**2))


def _rate(position: Channel, speed: Channel) -> float | None:
    """Factor from the speed's numbers to the rate of the position's; None if the dimensions are others."""
    if position is speed or position.time.size != speed.time.size or "1" in (position.unit, speed.unit):
        return None
    try:
        for length, rate in (("m", "m/s"), ("rad", "rad/s")):
            if same_dimension(position.unit, length) and same_dimension(speed.unit, rate):
                return conversion(speed.unit, rate)[0] / conversion(position.unit, length)[0]
    except UnitError:
        return None
    return None


def _moved(position: Channel, speed: Channel, factor: float) -> Iterator[Finding]:
    """Whether the speed is the rate of the position but for its sign, but for a while, or the other way round."""
    travelled = factor * _integral(speed.clean, speed.time)
    moved = position.clean - position.clean[0]
    if float(np.ptp(moved)) < 20.0 * max(position.noise, position.quantum):
        return
    width = max(10, moved.size // 50)
    a, b = travelled[width:] - travelled[:-width], moved[width:] - moved[:-width]
    if abs(_correlation(a, b)) > _ALIKE:
        return
    if _signed(b) and not _signed(a) and _correlation(a, np.abs(b)) > _ALIKE:
        text = f"{speed.name} has one sign where the derivative of {position.name} has both: its magnitude was recorded"
        yield speed.finding("sign", "error", text)
        return
    still = _still(position, travelled)
    if still is not None:
        reach = np.convolve(still, np.ones(2 * width + 1))[width:-width] > 0.5
        free = ~(reach[width:] | reach[:-width])
        if _correlation(a[free], b[free]) > _ALIKE:
            yield _stuck(position, still, speed)
        return
    # Exchanged: the numbers called a speed are the integral of those called a position.
    integral = _integral(position.clean, position.time)
    c, d = integral[width:] - integral[:-width], speed.clean[width:] - speed.clean[:-width]
    if _correlation(c, d) > _ALIKE:
        text = f"{position.name} is the derivative of {speed.name}, not its integral: are their columns exchanged?"
        yield position.finding("unit", "error", text)
        yield speed.finding("unit", "error", text)


def _integral(values: FloatArray, time: FloatArray) -> FloatArray:
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(time)
    return np.concatenate(([0.0], np.cumsum(steps)))
