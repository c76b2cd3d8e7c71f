"""All detectors over recordings."""

from collections.abc import Callable, Collection, Iterator, Sequence

import numpy as np

from thsa_cosim.inspection.across import across_findings
from thsa_cosim.inspection.channel import Channel
from thsa_cosim.inspection.course import moving_start, temperature_drift, temperature_unit, unequal_noise
from thsa_cosim.inspection.finding import Finding, Inspection
from thsa_cosim.inspection.jumps import jumps
from thsa_cosim.inspection.levels import dead_band, stuck_bit
from thsa_cosim.inspection.outliers import outliers
from thsa_cosim.inspection.pairs import pair_findings
from thsa_cosim.inspection.samples import dependent_samples, resolution, sentinels
from thsa_cosim.inspection.spectrum import hum
from thsa_cosim.inspection.stretches import clipped, repeated, stuck
from thsa_cosim.inspection.time_axis import time_findings
from thsa_cosim.inspection.time_unit import time_unit
from thsa_cosim.inspection.witness import with_witnesses
from thsa_cosim.recordings import Recording
from thsa_cosim.signals import FloatArray

CHANNEL_DETECTORS: tuple[Callable[[Channel], Iterator[Finding]], ...] = (
    sentinels,
    dependent_samples,
    resolution,
    clipped,
    stuck,
    repeated,
    stuck_bit,
    dead_band,
    outliers,
    jumps,
    hum,
    unequal_noise,
    temperature_drift,
    temperature_unit,
    moving_start,
)
_OF_WRAPS = ("spikes", "dropouts", "interpolated-samples", "held-samples", "unequal-noise", "clipped")
"""What a counter that wraps looks like besides."""
_LEAST = 16
_ROUNDING = 1e-7
"""Noise in shares of the largest value, that rounding to single precision makes."""
_APART = 1.6
"""Ratio of one sensor's noise in one recording to that in the others."""


def inspect(recordings: Sequence[Recording], inputs: Collection[str]) -> Inspection:
    """Inspect recordings as a scenario reads them, less what its repairs leave out; ``inputs`` drive the FMU."""
    findings: list[Finding] = []
    for recording in recordings:
        channels = [_channel(recording, name, name in inputs) for name in recording.samples]
        fast = [s.time for s in recording.samples.values() if not s.averaged]
        times = _different(fast or [s.time for s in recording.samples.values()])
        findings += inspect_channels(recording.name, channels, times)
        if recording.lead_in > 0.0:
            findings = [f for f in findings if (f.recording, f.kind) != (recording.name, "moving-start")]
    return Inspection.of((*findings, *_noises(recordings, inputs)), repairs_of(recordings))


def repairs_of(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """What the scenario's repairs did to the recordings: sentences."""
    return tuple(f"{r.name}: {sentence}" for r in recordings for sentence in r.repairs)


def inspect_channels(
    recording: str, channels: Sequence[Channel], times: Sequence[FloatArray]
) -> Iterator[Finding]:
    """Yield the findings on a recording's time axes (in s, in the file's order), on each channel and across them."""
    for time in times:
        yield from time_findings(recording, time)
    usable = [c for c in channels if c.values.size >= _LEAST and c.plain.min() < c.plain.max()]
    usable = with_witnesses(usable)
    told: set[tuple[str, str]] = set()
    for channel in usable:
        found = [f for detect in CHANNEL_DETECTORS for f in detect(channel)]
        wraps = any(f.kind == "wrapped" for f in found)
        found = [f for f in found if not wraps or f.kind not in _OF_WRAPS]
        told |= {(f.channel, f.kind) for f in found}
        yield from found
    between = [*across_findings(usable), *pair_findings(usable)]
    yield from (f for f in between if (f.channel, f.kind) not in told)
    if not any((f.channel, f.kind) == ("time", "unit") for f in between):
        yield from time_unit(recording, usable)


def _channel(recording: Recording, name: str, driven: bool) -> Channel:
    samples = recording.samples[name]
    kept = ~samples.left_out
    return Channel(
        recording=recording.name,
        name=name,
        unit=samples.unit,
        role="input" if driven else "output",
        time=samples.time[kept],
        values=samples.values[kept],
        held=samples.held,
        averaged=samples.averaged,
        written=None if samples.written is None else samples.written[kept],
    )


def _different(times: Sequence[FloatArray]) -> list[FloatArray]:
    """The time axes that differ from each other."""
    found: list[FloatArray] = []
    for time in times:
        if not any(time is other or np.array_equal(time, other) for other in found):
            found.append(time)
    return found


def _noises(recordings: Sequence[Recording], inputs: Collection[str]) -> Iterator[Finding]:
    """One sensor has one noise: a recording in which it is another was made with something else."""
    names = dict.fromkeys(name for r in recordings for name in r.samples if name not in inputs)
    for name in names:
        # Rounding (1e-16) is no sensor's noise: such a channel was computed.
        least = _ROUNDING * max(
            (float(np.max(np.abs(r.signals[name]))) for r in recordings if name in r.signals), default=0.0
        )
        noises = [
            (r, r.noise[name]) for r in recordings if name in r.samples and r.noise.get(name, 0.0) > least
        ]
        if len(noises) < 2:
            continue
        usual = float(np.median([noise for _, noise in noises]))
        for recording, noise in noises:
            if not usual / _APART < noise < usual * _APART:
                channel = _channel(recording, name, driven=False)
                text = (
                    f"the noise of {name} is {channel.number(noise)} here and"
                    f" {channel.number(usual)} in the recordings together"
                )
                yield channel.finding("unequal-noise", "warning", text)
