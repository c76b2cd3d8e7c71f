"""A wrong gain of a sensor that a fit cannot see: parameters take it up, and only what was expected of them tells.

A signal that is some per cent too large changes the parameters by what makes the model as much larger. Where that
leaves nothing of the misfit, no residual shows it. What is left to compare with is the drawing: if parameters differ
from it in just the way in which the gain would change them, the sensor is in doubt, and the parameters with it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.inspection.finding import Finding, Severity
from thsa_cosim.inspection.trust import Residual
from thsa_cosim.signals import FloatArray

_UNSEEN = 60.0
"""Sum of squares, in noise variances, up to which a slip leaves no trace (z of 7.7)."""
_LEAST, _MOST = 0.02, 0.5
"""Gain that is worth a word, and the largest one that a sensor has; more is another unit."""
_SURE = 5.0
"""Standard errors by which the gain has to differ from 1."""
_LIKE = 0.9
"""Share of the parameters' distance from the drawing, as a sum of squares, that the gain has to account for."""
_AGREES = 4.0
"""Standard deviations, of the value and the drawing, up to which a parameter differs as the gain would make it."""
_DRAWN = 0.01
"""How well a drawing is known, relative."""


@dataclass(frozen=True)
class Expected:
    """An identified ``value`` with its ``stderr``, and what the drawing says (``expected``; None: nothing).

    ``scale``: change of the value per unit of the parameter's column in ``Residual.slopes``, in ``unit``.
    ``published``: whether ``expected`` is a published law's, no start value.
    """

    name: str
    unit: str
    value: float
    stderr: float | None
    expected: float | None
    scale: float
    published: bool = False


def hidden_gains(residuals: Sequence[Residual], parameters: Sequence[Expected]) -> Iterator[Finding]:
    """Yield findings on gains of fitted signals that ``parameters`` (p of them) take up; slopes (n, p) are needed."""
    if not residuals or any(r.slopes.shape[1] != len(parameters) or not r.simulated.size for r in residuals):
        return
    slopes = np.concatenate([r.slopes for r in residuals])
    if not np.all(np.isfinite(slopes)):
        return
    for channel in dict.fromkeys(r.channel for r in residuals):
        shape = np.concatenate(
            [(r.simulated / r.noise if r.channel == channel else np.zeros(r.values.size)) for r in residuals]
        )
        taken, *_ = np.linalg.lstsq(slopes, shape, rcond=1e-9)
        left = float(np.sum((shape - slopes @ taken) ** 2))
        found = _gain(parameters, np.array([p.scale for p in parameters]) * taken)
        if found is not None and left * (found[0]) ** 2 < _UNSEEN:
            yield _finding(residuals, channel, found[0], found[1])


def _gain(
    parameters: Sequence[Expected], change: FloatArray
) -> tuple[float, list[tuple[Expected, float]]] | None:
    """By how much what is measured is too large, relative to itself, and what that does to each parameter; None if not.

    ``change`` (p,): of each parameter per unit of that. It accounts for the distances from the drawing.
    """
    known = [
        (p, float(c), p.expected, p.stderr)
        for p, c in zip(parameters, change, strict=True)
        if p.expected and p.stderr is not None and np.isfinite(p.stderr) and abs(c) > 0.1 * abs(p.value)
    ]
    if not known:
        return None
    effect = np.array([c for _, c, _, _ in known])
    away = np.array([p.value - e for p, _, e, _ in known])
    error = np.array([s for *_, s in known])
    weight = 1.0 / (error**2 + (_DRAWN * np.array([e for _, _, e, _ in known])) ** 2)
    power = float(np.sum(weight * effect**2))
    gain = float(np.sum(weight * effect * away)) / power
    apart = float(np.sum(weight * away**2))
    if not _LEAST < abs(gain) < _MOST or gain * gain * power < _LIKE * apart:
        return None
    if np.any(np.sqrt(weight) * np.abs(away - gain * effect) > _AGREES):
        return None
    if abs(gain) * np.sqrt(float(np.sum(effect**2 / error**2))) < _SURE:
        return None
    return gain, [(p, gain * c) for p, c, _, s in known if abs(gain * c) > 2.0 * s]


def _finding(
    residuals: Sequence[Residual], channel: str, gain: float, taken: Sequence[tuple[Expected, float]]
) -> Finding:
    factor = 1.0 / (1.0 - gain)  # the values, and what follows from them, have it already
    changes = " and ".join(f"{p.name} by {_change(p, change)}" for p, change in taken)
    text = (
        f"a gain of {factor:.3g} in the sensor of {channel} would leave no trace in this fit: it would change"
        f" {changes}, and that is how they differ from the expected values; calibrate {channel} before you use them"
    )
    recording = next(r.recording for r in residuals if r.channel == channel)
    severity: Severity = "warning" if len(taken) > 1 else "note"
    remedy = (
        f"[recordings.columns.{channel}]\nscale = {1.0 / factor:.4g}  # only if a calibration confirms it"
    )
    return Finding(recording, channel, "gain", severity, text, (), remedy)


def _change(parameter: Expected, change: float) -> str:
    """A change as a share of what the value would be without it, of a value near zero in its unit."""
    share = 100.0 * change / (parameter.value - change)
    return f"{share:+.2g} %" if abs(share) < 100.0 else f"{change:+.2g} {parameter.unit}".rstrip()
