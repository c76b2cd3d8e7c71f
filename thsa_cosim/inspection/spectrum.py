"""Hum: a steady line in the spectrum that does not care what the drive does."""

from collections.abc import Iterator

import numpy as np

from thsa_cosim.inspection.channel import Channel
from thsa_cosim.inspection.finding import Finding
from thsa_cosim.signals import FloatArray

MAINS = (50.0, 60.0, 400.0)
_HARMONICS = 4
_PARTS = 8
_LEAST = 512
_WEAK = 0.5
"""σ of the noise: a weaker line does not matter."""


def hum(channel: Channel) -> Iterator[Finding]:
    """A line at a mains frequency or its harmonics, equally strong all the time."""
    if channel.averaged or channel.silent or channel.values.size < _LEAST or channel.step <= 0.0:
        return
    steps = np.diff(channel.time) / channel.step
    if steps.max() > 20.0 or np.mean(np.abs(steps - 1.0) > 0.25) > 0.01:
        return  # with gaps and lost samples, the phase is lost
    grid = np.arange(channel.time[0], channel.time[-1], channel.step)
    values = np.interp(grid, channel.time, channel.clean)
    bend = np.diff(values, 2)  # what is slow, and steps of the motion, would swamp the line
    spectrum = np.abs(np.fft.rfft(bend * np.hanning(bend.size))) ** 2
    found = []
    for base in MAINS:
        for multiple in range(1, _HARMONICS + 1):
            line = _line(bend, spectrum, base * multiple, channel)
            if line is not None:
                found.append((line, base * multiple))
    if not found:
        return
    amplitude, frequency = max(found)
    text = (
        f"a steady {frequency:.4g} Hz of amplitude {channel.number(amplitude)} runs through {channel.name},"
        f" {amplitude / channel.noise:.2g} times its noise"
    )
    yield channel.finding("hum", "warning", text)


def _line(bend: FloatArray, spectrum: FloatArray, frequency: float, channel: Channel) -> float | None:
    """Amplitude of a line within 0.5 % of ``frequency``, if it is there in every part of the recording.

    ``bend`` (n,): second differences of the signal; ``spectrum``: their power.
    """
    step = channel.step
    if frequency * step > 0.45 or frequency * step * (bend.size + 2) < 30:
        return None
    frequencies = np.fft.rfftfreq(bend.size, step)
    resolution = 2.5 / (bend.size * step)
    near = np.abs(frequencies - frequency) <= max(0.005 * frequency, resolution)
    around = (np.abs(frequencies - frequency) <= max(0.1 * frequency, 20 * resolution)) & ~near
    if not near.any() or np.sum(around) < 10:
        return None
    peak = int(np.flatnonzero(near)[np.argmax(spectrum[near])])
    # An exponential distribution's largest of m is about log m means: ten times that is no chance.
    if spectrum[peak] < 10.0 * np.log(np.sum(around)) * np.median(spectrum[around]):
        return None
    if spectrum[peak] < 4.0 * np.max(spectrum[around]):
        return None
    exact = float(frequencies[peak])
    parts = [_amplitude(part, exact, step) for part in np.array_split(bend, _PARTS)]
    gain = 4.0 * float(np.sin(np.pi * exact * step) ** 2)
    amplitude = float(np.median(parts)) / gain
    steady = min(parts) >= 0.4 * max(parts) and amplitude >= _WEAK * channel.noise
    return amplitude if steady else None


def _amplitude(part: FloatArray, frequency: float, step: float) -> float:
    window = np.hanning(part.size)
    turn = np.exp(-2j * np.pi * frequency * step * np.arange(part.size))
    return float(2.0 * np.abs(np.sum(window * part * turn)) / np.sum(window))
