"""Whether a fit explains its recordings: is what it leaves noise?

Residual tests as in system identification (Ljung, System Identification, 2nd ed., section 16.6): the size of the
residuals against the sensor's noise, their whiteness, their correlation with the inputs. With ten thousand samples
every model fails a significance test, so that what counts is the size of what is left: the share of the residual's
power that its neighbours, or the inputs, account for.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from thsa_cosim.signals import FloatArray

_LARGE = 1.4
"""rmse / noise from which on the misfit is no noise: it is then as large as the noise itself."""
_STRUCTURE = 0.3
"""Share of the residual's power that neighbours account for."""
_FOLLOWS = 0.1
"""Share that an input, or how it changes, accounts for."""
_DEPENDS, _LEVELS, _LEAST_LEVELS = 0.04, 16, 30
"""Share that the signal's own size accounts for; by how many levels of it, of how many samples at least."""
_PARTS, _LEAST_PART = 8, 200
"""Parts of a recording that are judged on their own, and their samples at least."""
_LAGS = 20
_MOST_REASONS = 12


@dataclass(frozen=True, eq=False)
class Residual:
    """What is left of ``channel`` in one recording: simulated less measured over noise, (n,), dimensionless.

    ``inputs``: by name, (n,) at the same samples; ``held``: those that stay from one sample to the next. ``noise``: 1 σ
    in ``unit``. For ``misfits`` also ``time`` (n,) s, ``simulated`` (n,) in ``unit``, and ``slopes`` (n, p): how the
    values follow each parameter, in any scale.
    """

    recording: str
    channel: str
    values: FloatArray
    noise: float
    unit: str
    inputs: Mapping[str, FloatArray] = field(default_factory=dict)
    time: FloatArray = field(default_factory=lambda: np.empty(0))
    simulated: FloatArray = field(default_factory=lambda: np.empty(0))
    slopes: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    held: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Trust:
    """``"explained"``: what is left is noise. ``reasons``: sentences, why it is not."""

    verdict: Literal["explained", "not-explained"]
    reasons: tuple[str, ...] = ()

    @classmethod
    def of(cls, reasons: Sequence[str]) -> "Trust":
        """The verdict that ``reasons`` lead to; empty ones do not count."""
        kept = tuple(reason for reason in reasons if reason)
        return cls("not-explained" if kept else "explained", kept[:_MOST_REASONS])

    def to_dict(self) -> dict[str, Any]:
        """Return ``trust`` of ``result.json``."""
        return {"verdict": self.verdict, "reasons": list(self.reasons)}


def judge(residuals: Sequence[Residual], known: Sequence[str] = ()) -> Trust:
    """Return whether ``residuals`` are noise, channel by channel over all recordings, then recording by recording.

    ``known``: reasons against it that are known already.
    """
    reasons: list[str] = list(known)
    for channel in dict.fromkeys(r.channel for r in residuals):
        own = [r for r in residuals if r.channel == channel and r.values.size]
        reasons += _channel(channel, own)
    return Trust("not-explained" if reasons else "explained", tuple(reasons[:_MOST_REASONS]))


def judge_ratios(ratios: Mapping[str, float]) -> Trust:
    """Return the same from nothing but rmse / noise of each channel."""
    reasons = [
        f"{name} is missed by {r:.3g} times its noise" for name, r in ratios.items() if not r <= _LARGE
    ]
    return Trust("not-explained" if reasons else "explained", tuple(reasons[:_MOST_REASONS]))


def _channel(channel: str, own: Sequence[Residual]) -> list[str]:
    reasons = []
    sizes = {r.recording: _rms(r.values) for r in own}
    samples = sum(r.values.size for r in own)
    together = float(np.sqrt(sum(r.values.size * sizes[r.recording] ** 2 for r in own) / max(samples, 1)))
    noise, unit = own[0].noise if own else 0.0, own[0].unit if own else ""
    worst = max(sizes, key=lambda name: sizes[name]) if sizes else ""
    if not np.isfinite(together):
        return [f"{channel} could not be simulated"]
    if together > _LARGE:
        rmse = f"{together * noise:.3g} {unit} rms" if len(own) == 1 else "rms"
        reasons.append(f"{channel} is missed by {together:.3g} times its noise ({rmse})")
    elif sizes and sizes[worst] > _LARGE:
        reasons.append(f"{channel} is missed by {sizes[worst]:.3g} times its noise in {worst}")
    elif part := max((_worst_part(r) for r in own), default=None):
        size, where, recording = part
        if size > _LARGE:
            reasons.append(f"{channel} is missed by {size:.3g} times its noise {where} of {recording}")
    if not reasons and together < 1.0:
        return reasons
    structure = float(np.mean([_predictable(r.values) for r in own])) if own else 0.0
    if structure > _STRUCTURE:
        reasons.append(
            f"what is left of {channel} is not noise: neighbouring samples account for {100 * structure:.0f} % of it"
        )
    follows = [found for r in own if (found := _follows(r)) is not None]
    if follows:
        share, name = max(follows)
        reasons.append(
            f"what is left of {channel} follows {name}, which accounts for {100 * share:.0f} % of it"
        )
    levels = max((_depends(r) for r in own), default=0.0)
    if levels > 0.0 and not follows:
        reasons.append(
            f"what is left of {channel} depends on its own size, which accounts for {100 * levels:.0f} % of it: a"
            " sensor that is not linear, or a missing effect"
        )
    return reasons


def _worst_part(residual: Residual) -> tuple[float, str, str]:
    """The largest rms / noise of any eighth of a recording, which one, and of which recording."""
    values, time = residual.values, residual.time
    if values.size < _PARTS * _LEAST_PART:
        return 0.0, "", residual.recording
    parts = np.array_split(np.arange(values.size), _PARTS)
    worst = max(parts, key=lambda part: _rms(values[part]))
    first, last = int(worst[0]), int(worst[-1])
    where = f"from {time[first]:.4g} s to {time[last]:.4g} s" if time.size == values.size else "in a part"
    return _rms(values[worst]), where, residual.recording


def _rms(values: FloatArray) -> float:
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(values**2)))


def _predictable(values: FloatArray) -> float:
    """Share of the power (n,) that the mean of four neighbours on each side accounts for; 0 for white noise."""
    if values.size < 100:
        return 0.0
    sums = np.convolve(values, np.concatenate((np.ones(4), [0.0], np.ones(4))) / 8.0, "same")
    power = float(np.sum(values**2))
    if power <= 0.0:
        return 0.0
    # Of white noise neighbours say nothing; fitted by one coefficient, what they account for is a correlation.
    both = float(np.sum(values * sums))
    return max(0.0, both) ** 2 / (power * float(np.sum(sums**2)) + 1e-300)


def _depends(residual: Residual) -> float:
    """Share of the residual's power that its mean over like simulated values accounts for; 0 below the limit.

    A lack-of-fit test: samples of like values repeat each other. ``values`` (n,) are white where the fit is right.
    """
    values, simulated = residual.values, residual.simulated
    power = float(np.sum(values**2))
    if values.size < _LEAST_LEVELS * _LEVELS or simulated.size != values.size or power <= 0.0:
        return 0.0
    ends = np.quantile(simulated, np.linspace(0.0, 1.0, _LEVELS + 1)[1:-1])
    level = np.searchsorted(ends, simulated, side="right")
    counts = np.bincount(level, minlength=_LEVELS)
    sums = np.bincount(level, values, minlength=_LEVELS)[counts > 0]
    between = float(np.sum(sums**2 / counts[counts > 0]))
    # Between m levels, white noise has m variances, with a standard deviation of sqrt(2 m).
    chance = (_LEVELS + 8.0 * np.sqrt(2.0 * _LEVELS)) * power / values.size
    return between / power if between > max(_DEPENDS * power, chance) else 0.0


def _follows(residual: Residual) -> tuple[float, str] | None:
    """The input, or its change, that accounts for most of the residual, and its share; None below the limit."""
    values = residual.values
    if values.size < 200:
        return None
    best: tuple[float, str] | None = None
    centred = values - np.mean(values)
    power = float(np.sum(centred**2))
    for name, signal in residual.inputs.items():
        for regressor, words in ((signal, name), (np.gradient(signal), f"how {name} changes")):
            moved = regressor - np.mean(regressor)
            scale = float(np.sum(moved**2))
            if scale <= 0.0 or power <= 0.0:
                continue
            lags = [0, *range(1, _LAGS, 3)]
            found = [float(np.sum(centred[lag:] * moved[: moved.size - lag])) for lag in lags]
            part = max(f * f for f in found) / (power * scale)
            if part > _FOLLOWS and (best is None or part > best[0]):
                best = (part, words)
    return best
