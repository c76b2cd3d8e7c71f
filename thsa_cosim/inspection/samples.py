"""Samples that are no measurements of their own, or none at all: held, interpolated, coarse, coded."""

from collections.abc import Iterator

import numpy as np

from thsa_cosim.inspection.channel import Channel, share
from thsa_cosim.inspection.finding import Finding, Severity

_DITHERED = 0.7
"""Noise in steps from which on averages see between the levels."""
_LEVELS = 100
"""A signal that is met by fewer levels than this over its range is coarse, if no noise dithers them."""


def dependent_samples(channel: Channel) -> Iterator[Finding]:
    """Held or interpolated samples: a slow channel in a fast table."""
    found = channel.independence
    if found.kind is None or channel.averaged:
        return
    table, own = 1.0 / channel.step, 1.0 / (channel.step * found.period)
    rates = f"{own:.4g} Hz in a {table:.4g} Hz table"
    command = channel.role == "input" and (channel.held or channel.silent)
    severity: Severity = "note" if command else "warning"
    remedy = "" if channel.role == "input" else f"[recordings.columns.{channel.name}]\nindependent = true"
    if found.kind == "held":
        text = f"{channel.name} repeats each value {found.period:.3g} times: {rates}"
        yield channel.finding("held-samples", severity, text, (), remedy)
    else:
        text = (
            f"{channel.name} runs straight over {found.period:.3g} samples at a time: {rates}, interpolated"
        )
        yield channel.finding("interpolated-samples", severity, text, (), remedy)


def resolution(channel: Channel) -> Iterator[Finding]:
    """A quantisation so coarse that it, and not the sensor's noise, is what is left of a good fit."""
    step = channel.quantum
    if step == 0.0 or channel.averaged or channel.role == "input" or channel.range <= 0.0:
        return
    levels = channel.range / step
    if channel.noise > _DITHERED * step or levels > _LEVELS:
        return
    text = (
        f"{channel.name} is resolved to {channel.number(step)}, {levels:.0f} steps over its range, with too little"
        f" noise to dither them"
    )
    yield channel.finding("coarse-resolution", "warning", text)


def sentinels(channel: Channel) -> Iterator[Finding]:
    """Codes for a missing value."""
    if not channel.coded.any():
        return
    written = channel.values if channel.written is None else channel.written
    codes = np.unique(written[channel.coded])
    count = int(np.sum(channel.coded))
    shown = ", ".join(f"{code:.6g}" for code in codes[:4])
    part, plural = share(count / channel.values.size), "s" if count > 1 else ""
    text = f"{count} sample{plural} of {shown} far outside of everything else ({part})"
    remedy = (
        f"[recordings.columns.{channel.name}]\nmissing = [{', '.join(repr(float(c)) for c in codes[:4])}]"
    )
    yield channel.finding("sentinel", "error", text, channel.spans(channel.coded, 1), remedy)
