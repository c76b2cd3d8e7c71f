"""Samples that are no measurements of their own, or none at all: held, interpolated, coarse, coded."""

from collections.abc import Iterator

import numpy as np

from thsa_cosim.inspection.channel import Channel, share
from thsa_cosim.inspection.finding import Finding, Severity
from thsa_cosim.recordings.independence import lattice_step
from thsa_cosim.recordings.noise import RESTING, white_noise
from thsa_cosim.recordings.outliers import Mask
from thsa_cosim.signals import FloatArray

_DITHERED = 0.7
"""Noise in steps from which on averages see between the levels."""
_WINDOW, _MORE, _PART = 64, 0.3, 0.15
"""Samples of a window; share of repeated values beyond chance, and share of such windows, that are no chance."""
_BURSTS, _LEAST = 5, 4
_LONGEST = 41
"""Samples of one value, from which on it is rest, or a sensor that is stuck."""
_ABOVE = 2.0
"""Quantisation steps of noise from which on a value that repeats is no chance."""
_SKIPPED, _VISITED = 2.0, 0.5
"""Usual change in quantisation steps, and share of the levels visited, that make a signal a schedule of set points."""
_MOVES = 4.0
"""Steps over its range that a signal has to make to be one."""
_LEVELS = 100
"""A signal that is met by fewer levels than this over its range is coarse, if no noise dithers them."""


def dependent_samples(channel: Channel) -> Iterator[Finding]:
    """Held, interpolated or smoothed samples: a slow channel in a fast table."""
    found = channel.independence
    if channel.averaged:
        return
    if found.kind is None:
        yield from _partly_held(channel)
        return
    table, own = 1.0 / channel.step, 1.0 / (channel.step * found.period)
    rates = f"{own:.4g} Hz in a {table:.4g} Hz table"
    command = channel.role == "input" and (channel.held or channel.silent or channel.drawn)
    severity: Severity = "note" if command else "warning"
    remedy = "" if channel.role == "input" else f"[recordings.columns.{channel.name}]\nindependent = true"
    if found.kind == "held":
        text = f"{channel.name} repeats each value {found.period:.3g} times: {rates}"
        yield channel.finding("held-samples", severity, text, (), remedy)
    elif found.kind == "smooth":
        text = (
            f"neighbouring samples of {channel.name} depend on each other over some {found.period:.3g} samples: it"
            f" was upsampled from a lower rate, or filtered"
        )
        # What drives a model may well be smooth, and need not be compared.
        yield channel.finding(
            "interpolated-samples", severity if channel.role == "output" else "note", text, (), remedy
        )
    else:
        text = (
            f"{channel.name} runs straight over {found.period:.3g} samples at a time: {rates}, interpolated"
        )
        yield channel.finding("interpolated-samples", severity, text, (), remedy)


def _partly_held(channel: Channel) -> Iterator[Finding]:
    """Values that repeat more often than noise and resolution make them: in a part, at no fixed rate, in bursts."""
    if channel.role == "input" and (channel.held or not channel.steady):
        return  # a command stays where it is told to
    same = np.diff(channel.plain) == 0.0
    starts, lengths = channel.runs
    short = lengths < RESTING
    step = lattice_step(channel.plain)
    usual, noise = _repeats(channel.plain, step)
    if noise < _ABOVE * step or not noise > 0.0:
        return  # too quiet a sensor gives a value twice by itself
    windows = same[: same.size // _WINDOW * _WINDOW].reshape(-1, _WINDOW)
    resting = np.repeat(~short, lengths)[1:][: windows.size].reshape(-1, _WINDOW)
    often = (np.mean(windows, axis=1) > usual + _MORE) & (np.mean(resting, axis=1) < 0.1)
    # Bursts: runs that noise makes once in a thousand recordings; those on a limit are clipped.
    seen = min(0.8, 1.3 * max(usual, float(np.median(np.mean(windows, axis=1))), 1e-3))
    limit = max(3.0, 1.0 + np.log(1e-3 / channel.values.size) / np.log(seen))
    inside = ~np.isin(channel.plain[starts], (channel.clean.min(), channel.clean.max()))
    bursts = (lengths <= _LONGEST) & inside & (lengths > limit)
    if np.mean(often) > _PART:
        mask = np.zeros(channel.values.shape, dtype=np.bool_)
        mask[1 : 1 + windows.size] = np.repeat(often, _WINDOW)
        part = float(np.mean(often))
        times = 1.0 / max(1.0 - float(np.mean(windows[often])), 1e-3)
        text = (
            f"{channel.name} repeats its values {times:.2g} times on average, at no fixed rate, in {share(part)} of the"
            " recording"
        )
        where = () if part > 0.9 else channel.spans(mask, _WINDOW)
        remedy = "" if channel.role == "input" else f"[recordings.columns.{channel.name}]\nindependent = true"
        sure: Severity = "warning" if channel.role == "output" else "note"
        yield channel.finding("held-samples", sure, text, where, remedy)
    elif np.sum(bursts) >= _BURSTS:
        mask = np.repeat(bursts, lengths)
        text = (
            f"{channel.name} holds its last value in {int(np.sum(bursts))} bursts of up to"
            f" {int(lengths[bursts].max())} samples ({share(float(np.mean(mask)))}): values were lost on the way"
        )
        yield channel.finding("dropouts", "warning", text, channel.spans(mask))


def _repeats(values: FloatArray, step: float) -> tuple[float, float]:
    """Share of samples that equal the one before by chance, and the noise (1 σ) that says so; 0 if it is none."""
    own = values[np.concatenate(([True], np.diff(values) != 0.0))]
    bends = np.abs(np.diff(own, 2))
    windows = np.median(bends[: bends.size // _WINDOW * _WINDOW].reshape(-1, _WINDOW), axis=1)
    noise = white_noise(own) if windows.size >= _LEAST else 0.0
    if noise > 0.0:  # a sensor's is there whatever the signal does
        low, middle, high = np.quantile(windows, (0.2, 0.5, 0.8))
        noise *= float(0.5 * middle < low and high < 2.0 * middle)
    # Two of a normal distribution fall on one step of a lattice; without a lattice, hardly ever.
    return (min(0.5 * step / (np.sqrt(np.pi) * noise), 0.6) if noise > 0.0 else 1.0), noise


def resolution(channel: Channel) -> Iterator[Finding]:
    """A quantisation so coarse that it, and not the sensor's noise, is what is left of a good fit."""
    step = channel.quantum
    if step == 0.0 or channel.averaged or channel.role == "input" or channel.range <= 0.0:
        return
    levels = channel.range / step
    if channel.noise > _DITHERED * step or levels > _LEVELS:
        return
    changes = np.abs(np.diff(channel.plain))
    if (
        np.median(changes[changes > 0.0]) > _SKIPPED * step
        and np.unique(channel.plain).size < _VISITED * levels
    ):
        return  # a schedule of set points: a sensor goes from a level to the next one
    text = (
        f"{channel.name} is resolved to {channel.number(step)}, {levels:.0f} steps over its range, with too little"
        f" noise to dither them"
    )
    # What hardly moves says little at any resolution: a temperature that stays.
    yield channel.finding("coarse-resolution", "warning" if levels >= _MOVES else "note", text)


def sentinels(channel: Channel) -> Iterator[Finding]:
    """Codes for a missing value."""
    if channel.coded.any():
        yield coded(channel, channel.coded)


def coded(channel: Channel, mask: Mask) -> Finding:
    """The finding that the samples of ``mask`` (n,) are codes."""
    written = channel.values if channel.written is None else channel.written
    codes = np.unique(written[mask])
    count = int(np.sum(mask))
    shown = ", ".join(f"{code:.6g}" for code in codes[:4])
    part, plural = share(count / channel.values.size), "s" if count > 1 else ""
    text = f"{count} sample{plural} of {shown} far outside of everything else ({part})"
    remedy = (
        f"[recordings.columns.{channel.name}]\nmissing = [{', '.join(repr(float(c)) for c in codes[:4])}]"
    )
    return channel.finding("sentinel", "error", text, channel.spans(mask, 1), remedy)
