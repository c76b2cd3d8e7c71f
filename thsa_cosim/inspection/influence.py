"""Which samples an identified value hangs on: a few that the model misses, or a stretch that asks for another value.

Influence diagnostics of regression (Belsley, Kuh, Welsch, Regression Diagnostics, 1980) and Hausman's test
(Econometrica 46, 1978): a fit without some of the samples may differ from the fit to all of them by what chance
allows. A damage that is short, or in one part of a recording, hardly shows in the misfit as a whole, and may still move
a value by many of its standard errors. One step of Gauss and Newton per question, from the Jacobian that the fit has
left; nothing is run.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from thsa_cosim.inspection.channel import spans
from thsa_cosim.inspection.finding import Finding, Span
from thsa_cosim.inspection.hidden import Expected
from thsa_cosim.inspection.trust import Residual
from thsa_cosim.recordings.outliers import Mask
from thsa_cosim.signals import FloatArray

_FAR = 4.0
"""σ from which on a sample weighs no more; of white noise, one in 16,000 is farther."""
_MOVED = 3.0
"""Stated standard errors by which a value moves that is worth a word."""
_SURE = 5.0
"""Standard deviations of that movement under chance."""
_PARTS = 8
_LEAST = 200
_FEW = 0.1
"""Share of the samples up to which they are few."""


def influences(residuals: Sequence[Residual], parameters: Sequence[Expected]) -> list[Finding]:
    """Return findings on samples that move ``parameters`` (p of them) out of line with the rest.

    The residuals are those of one fit, with slopes (n, p) in the parameters' order; without them nothing is said.
    """
    complete = [
        r.slopes.shape == (r.values.size, len(parameters)) and r.time.size == r.values.size for r in residuals
    ]
    if not residuals or not all(complete):
        return []
    values = np.concatenate([r.values for r in residuals])
    slopes = np.concatenate([r.slopes for r in residuals])
    if values.size < _LEAST or all(p.stderr is None for p in parameters):
        return []
    with np.errstate(over="ignore", invalid="ignore"):
        if not np.isfinite(float(np.sum(values**2) + np.sum(slopes**2))):
            return []
    fit = _Fit(values, slopes, parameters)
    few = list(_few_samples(fit, residuals))
    return few or list(_stretches(fit, residuals))


class _Fit:
    """The normal equations of a fit: ``values`` (N,) are left, ``slopes`` (N, p) say what parameters do to them."""

    def __init__(self, values: FloatArray, slopes: FloatArray, parameters: Sequence[Expected]) -> None:
        size = np.linalg.norm(slopes, axis=0)
        self.values, self.parameters = values, parameters
        self.size = np.where(size > 0.0, size, 1.0)
        self.slopes = slopes / self.size
        self.normal = self.slopes.T @ self.slopes
        self.scale = np.array([p.scale for p in parameters]) / self.size
        self.stderr = np.array(
            [np.inf if p.stderr is None or not p.stderr > 0.0 else p.stderr for p in parameters]
        )

    def step(self, normal: FloatArray, gradient: FloatArray) -> FloatArray:
        """How far a fit with other normal equations moves the values (p,), in their own units."""
        return np.asarray(-self.scale * (np.linalg.pinv(normal, rcond=1e-12, hermitian=True) @ gradient))

    def variance(self, normal: FloatArray) -> FloatArray:
        """Variances (p,) of the values under white noise of 1 σ."""
        return np.asarray(self.scale**2 * np.diag(np.linalg.pinv(normal, rcond=1e-12, hermitian=True)))


def _few_samples(fit: _Fit, residuals: Sequence[Residual]) -> Iterator[Finding]:
    """Samples far off the model: what the values would be if they weighed no more than others (Huber's weights)."""
    far = np.abs(fit.values) > _FAR
    if not far.any() or np.mean(far) > _FEW:
        return
    weights = np.where(far, _FAR / np.maximum(np.abs(fit.values), _FAR), 1.0)
    weighted = fit.slopes * weights[:, None]
    moved = fit.step(weighted.T @ fit.slopes, weighted.T @ fit.values)
    # What the search left undone is no influence.
    moved = moved - fit.step(fit.normal, fit.slopes.T @ fit.values)
    worst = int(np.argmax(np.abs(moved) / fit.stderr))
    if abs(moved[worst]) < _MOVED * fit.stderr[worst]:
        return
    pull = fit.slopes[:, worst] * fit.values * (1.0 - weights)
    residual, own = max(_parts(residuals, far), key=lambda part: float(np.sum(np.abs(pull[part[1]]))))
    here = far[own]
    stretches = spans(residual.time, here)
    name = residual.channel
    text = (
        f"{int(np.sum(here))} samples of {name} ({100.0 * np.mean(here):.2g} %) lie more than {_FAR:g} times its noise"
        f" off the model, and {_change(fit, worst, moved)} if samples so far off weigh less"
    )
    pairs = ", ".join(f"[{a:.6g}, {b:.6g}]" for a, b in stretches)
    remedy = f'[cost]\nerror = "huber"  # or leave them out: [recordings.columns.{name}] mask = [{pairs}]'
    yield Finding(residual.recording, name, "outlying-samples", "warning", text, stretches, remedy)


def _stretches(fit: _Fit, residuals: Sequence[Residual]) -> Iterator[Finding]:
    """A recording, or up to half of one, without which the values would be others, by more than chance."""
    recordings = list(dict.fromkeys(r.recording for r in residuals))
    whole, gradient = fit.variance(fit.normal), fit.slopes.T @ fit.values
    undone = fit.step(fit.normal, gradient)
    with np.errstate(divide="ignore", invalid="ignore"):
        # By correlated noise, as the stated errors have it.
        inflation = np.maximum(fit.stderr**2 / whole, 1.0)
    best: tuple[float, int, FloatArray, str, Span] | None = None
    for name in recordings:
        ends, normals, gradients = _by_parts(fit, residuals, name)
        for first, last in _pieces(len(recordings) > 1):
            normal = fit.normal - np.sum(normals[first:last], axis=0)
            moved = fit.step(normal, gradient - np.sum(gradients[first:last], axis=0)) - undone
            with np.errstate(divide="ignore", invalid="ignore"):  # of what nothing depends on
                chance = np.sqrt(inflation * np.maximum(fit.variance(normal) - whole, 1e-6 * whole))
                sure = np.where(np.abs(moved) > _MOVED * fit.stderr, np.abs(moved) / chance, 0.0)
            k = int(np.argmax(np.nan_to_num(sure)))
            if sure[k] > _SURE and (best is None or sure[k] > best[0]):
                best = (float(sure[k]), k, moved, name, (float(ends[first]), float(ends[last])))
    if best is None:
        return
    _, k, moved, name, span = best
    text = (
        f"what is from {span[0]:.4g} s to {span[1]:.4g} s does not agree with the rest: without it,"
        f" {_change(fit, k, moved)}; a damage there, or a missing effect"
    )
    yield Finding(name, "time", "disagreement", "warning", text, (span,))


def _by_parts(
    fit: _Fit, residuals: Sequence[Residual], recording: str
) -> tuple[FloatArray, list[FloatArray], list[FloatArray]]:
    """The ends (m + 1,) in s of m parts of a recording, and what each adds to the normal equations."""
    time = np.concatenate([np.where(r.recording == recording, r.time, np.nan) for r in residuals])
    ends = np.linspace(np.nanmin(time), np.nanmax(time), _PARTS + 1)
    part = np.where(np.isnan(time), -1, np.minimum(np.searchsorted(ends, time, side="right") - 1, _PARTS - 1))
    normals, gradients = [], []
    for k in range(_PARTS):
        slopes, values = fit.slopes[part == k], fit.values[part == k]
        normals.append(slopes.T @ slopes)
        gradients.append(slopes.T @ values)
    return ends, normals, gradients


def _pieces(several: bool) -> Iterator[tuple[int, int]]:
    """Neighbouring parts [first, last) to leave out: up to half of a recording, or, of several, all of it."""
    for first in range(_PARTS):
        for last in range(first + 1, _PARTS + 1):
            if last - first <= _PARTS // 2 or (several and last - first == _PARTS):
                yield first, last


def _change(fit: _Fit, k: int, moved: FloatArray) -> str:
    """How far the value ``k`` moves, in words."""
    parameter = fit.parameters[k]
    errors = abs(moved[k]) / fit.stderr[k]
    return (
        f"{parameter.name} changes from {parameter.value:.4g} to {parameter.value + moved[k]:.4g} {parameter.unit}"
        f" ({errors:.2g} standard errors)"
    )


def _parts(residuals: Sequence[Residual], marked: Mask) -> list[tuple[Residual, slice]]:
    """The residuals that hold ``marked`` (N,) samples, with their rows."""
    found, first = [], 0
    for r in residuals:
        rows = slice(first, first + r.values.size)
        first = rows.stop
        if marked[rows].any():
            found.append((r, rows))
    return found
