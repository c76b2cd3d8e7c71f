"""What changes over a recording that should not: noise, temperature; and what should be zero at its start."""

from collections.abc import Iterator

import numpy as np

from thsa_cosim.errors import UnitError
from thsa_cosim.inspection.channel import Channel
from thsa_cosim.inspection.finding import Finding, Severity
from thsa_cosim.recordings.independence import lattice_step
from thsa_cosim.recordings.noise import white_noise
from thsa_cosim.recordings.outliers import running_median
from thsa_cosim.signals import FloatArray
from thsa_cosim.units import convert, same_dimension

_WARM_NOTE, _WARM = 1.0, 2.5
"""K over a recording that are worth a note, a warning."""
_TOO_HOT, _TOO_COLD, _ZERO_CELSIUS = 205.0, -150.0, 273.15
"""degC that neither windings nor magnets nor grease of a drive reach: 205 degC are -68 degC in K."""
_WINDOWS = 16
_LEAST_SHARE = 1e-5
"""Noise in shares of the range, below which there is no sensor's."""
_UNEQUAL = 1.7
"""Ratio of the noise in one stretch to that in the others."""
_GROWING, _MONOTONE = 2.0, 0.9
"""Ratio of the noise at the end to that at the beginning, and rank correlation with time, of noise that grows."""
_WHITE = 1.5
"""Noise of every second sample in shares of the noise of all, from which on it is motion."""
_MOVING = 8.0
"""σ off rest."""


def unequal_noise(channel: Channel) -> Iterator[Finding]:
    """Noise that is another in one part of the recording: a cable, a gain, a filter that was switched."""
    if channel.silent or channel.averaged:
        return
    index = channel.fresh_index
    values = channel.clean[index]
    if values.size < 40 * _WINDOWS:
        return
    parts = np.array_split(np.arange(values.size), _WINDOWS)
    floor = max(channel.quantum / np.sqrt(12.0), 1e-3 * channel.noise)
    least = max(0.4 * channel.quantum, _LEAST_SHARE * channel.range)
    levels = np.array([max(white_noise(values[part]), floor) for part in parts])
    if levels.min() < least:
        return
    block = _other_block(levels)
    if block is None:
        half = [max(white_noise(values[part][::2]), floor) for part in parts]
        white = np.quantile(np.array(half) / levels, 0.8) < _WHITE  # what bends with the motion is no noise
        if white and levels.min() > lattice_step(channel.plain):
            yield from _trend(channel, levels)
        return
    first, last = index[parts[block[0]][0]], index[parts[block[1] - 1][-1]]
    inside = float(np.median(levels[slice(*block)]))
    outside = float(np.median(np.delete(levels, np.s_[slice(*block)])))
    text = (
        f"the noise of {channel.name} is {channel.number(inside)} in one part of the recording and"
        f" {channel.number(outside)} in the rest"
    )
    where = ((float(channel.time[first]), float(channel.time[last])),)
    yield channel.finding("unequal-noise", "warning", text, where)


def _trend(channel: Channel, levels: FloatArray) -> Iterator[Finding]:
    """Noise that grows (or falls) from the first window to the last of (m,) ``levels``, whatever the signal does."""
    course = running_median(np.log(levels), 5)
    change = float(course[-1] - course[0])
    if abs(change) < np.log(_GROWING):
        return
    from scipy.stats import spearmanr  # slow to import, and such noise is rare

    if abs(spearmanr(np.arange(levels.size), levels).statistic) < _MONOTONE:
        return
    text = (
        f"the noise of {channel.name} {'grows' if change > 0.0 else 'falls'} over the recording, from"
        f" {channel.number(float(np.exp(course[0])))} to {channel.number(float(np.exp(course[-1])))}"
    )
    yield channel.finding("unequal-noise", "warning", text)


def _other_block(levels: FloatArray) -> tuple[int, int] | None:
    """The windows [a, b) whose ``levels`` (m,) are alike, and unlike all others, which are alike as well.

    Noise that goes up and down with the motion makes no such block.
    """
    best, gain = None, np.log(_UNEQUAL)
    logs = np.log(levels)
    for a in range(levels.size):
        for b in range(a + 2, levels.size + 1):
            inside, outside = logs[a:b], np.concatenate((logs[:a], logs[b:]))
            if outside.size < inside.size or outside.size < 3:
                continue
            apart = abs(float(np.median(inside) - np.median(outside)))
            alike = max(float(np.ptp(inside)), float(np.ptp(outside)))
            if apart > gain and alike < 0.6 * apart:
                best, gain = (a, b), apart
    return best


def temperature_drift(channel: Channel) -> Iterator[Finding]:
    """A temperature that does not stay: parameters that depend on it are then an average."""
    try:
        if channel.unit in ("", "1") or not same_dimension(channel.unit, "K"):
            return
        kelvin = np.asarray(convert(channel.plain, channel.unit, "degC"))
    except UnitError:
        return
    parts = [float(np.median(part)) for part in np.array_split(kelvin, 10) if part.size]
    change = max(parts) - min(parts)
    noise = float(np.median(np.abs(np.diff(kelvin)))) / np.sqrt(max(1.0, kelvin.size / 10.0))
    if change < _WARM_NOTE or change < 6.0 * noise:
        return
    severity: Severity = "warning" if change > _WARM else "note"
    text = f"{channel.name} goes from {parts[0]:.4g} degC to {parts[-1]:.4g} degC, over {change:.2g} K in all"
    yield channel.finding("temperature-drift", severity, text)


def temperature_unit(channel: Channel) -> Iterator[Finding]:
    """Kelvin called degrees Celsius, or the other way round: what no drive survives, where the other is usual."""
    try:
        if channel.unit in ("", "1") or not same_dimension(channel.unit, "K"):
            return
        celsius = float(np.median(np.asarray(convert(channel.plain, channel.unit, "degC"))))
    except UnitError:
        return
    if _TOO_HOT < celsius < _TOO_HOT + 150.0:
        meant, other = "K", celsius - _ZERO_CELSIUS
    elif celsius < _TOO_COLD and celsius + _ZERO_CELSIUS > -100.0:
        meant, other = "degC", celsius + _ZERO_CELSIUS
    else:
        return
    text = f"{channel.name} is {celsius:.4g} degC; in {meant} its numbers would be {other:.4g} degC: is that its unit?"
    remedy = f'[recordings.columns.{channel.name}]\nunit = "{meant}"'
    yield channel.finding("unit", "warning", text, (), remedy)


def moving_start(channel: Channel) -> Iterator[Finding]:
    """A speed that is not zero where the recording begins, where a model begins at rest."""
    if channel.role != "output" or not _is_speed(channel.unit):
        return
    first = channel.clean[: min(5, channel.clean.size)]
    limit = max(_MOVING * channel.noise, 2.0 * channel.quantum, 0.01 * channel.range)
    if np.min(np.abs(first)) <= limit or abs(float(np.sum(np.sign(first)))) < first.size:
        return
    speed = channel.number(float(first[0]))
    text = f"{channel.name} is {speed} at the start: the recording begins in motion, a model at rest"
    remedy = "[recordings.time]\nlead_in = 0.5  # s that drive the model and are not compared"
    yield channel.finding(
        "moving-start", "warning", text, ((float(channel.time[0]), float(channel.time[0])),), remedy
    )


def _is_speed(unit: str) -> bool:
    try:
        return unit not in ("", "1") and (same_dimension(unit, "m/s") or same_dimension(unit, "rad/s"))
    except UnitError:
        return False
