"""Combinations of unknowns that only the noise of the differences tells apart: the recordings do not determine them.

Where two columns of a Jacobian are proportional (Coulomb friction before and behind a rigid gear), what tells them
apart is what the solver and the curvature make of two difference steps, and JᵀJ takes it for information. Other steps
make it anew: what they change in a combination says how much of it is noise, as in an identification
(`search.uncertainty`).
"""

from dataclasses import replace

import numpy as np

from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, columns, cost_of
from thsa_cosim.signals import FloatArray

#: A combination of columns of length 1 whose response is less is looked at, unless its information is less than this
#: share of the drawing's; an unknown belongs to it from the same share on.
CLOSE = 0.1
#: It is noise if its response is less than so many times what half the steps change in it. Errors that grow with the
#: step change by half, others by more.
CLEAR = 3.0
#: A step to the drawing counts unless the cost rises by so much, a standard deviation of one unknown: the solver's
#: errors change it by less, either way.
RISEN = 1.0


def without_noise(bench: Bench, fit: Fit) -> Fit:
    """``fit`` without the combinations of unknowns that half the difference steps do not confirm.

    Of these it knows what the drawing says, and goes back there: noise led the fit away from it.
    """
    which = close(fit)
    if not which:
        return fit
    again, _ = columns(bench, fit.unknowns, fit.vector, fit.residual, which, 0.5 * fit.steps)
    jacobian = fit.jacobian
    sure = confirmed(jacobian[:, which], again)
    if sure is None:
        return fit
    jacobian = jacobian.copy(order="F")
    jacobian[:, which] = sure
    return _moved(bench, replace(fit, own=jacobian, shared=None))


def close(fit: Fit) -> list[int]:
    """The unknowns in a combination to which hardly anything responds, and of which the Jacobian claims to know."""
    jacobian, prior = fit.jacobian, fit.unknowns.precision * fit.unknowns.scale
    size = np.linalg.norm(jacobian, axis=0)
    used = np.flatnonzero(size)
    values, directions = _combinations(jacobian[:, used] / size[used])
    belong = np.abs(directions) > CLOSE  # a trace of a shape that is known exactly would outweigh all others
    drawn = (prior[used] / size[used]) ** 2 @ (directions * belong) ** 2
    looked_at = (values < CLOSE**2) & (values > CLOSE * drawn)
    return [int(j) for j in used[np.any(belong[:, looked_at], axis=1)]]


def confirmed(first: FloatArray, second: FloatArray) -> FloatArray | None:
    """The columns ``first`` (N, m) without the combinations that are noise beside ``second`` (N, m), by other steps.

    None where all of them are confirmed, or a column could not be taken again.
    """
    if not np.all(np.any(second, axis=0)):
        return None
    size = np.linalg.norm(first, axis=0)
    scaled, changed = first / size, (first - second) / size
    _, directions = _combinations(scaled)
    response, change = (np.linalg.norm(one @ directions, axis=0) for one in (scaled, changed))
    noise = directions[:, (response < CLOSE) & (response < CLEAR * change)]
    return np.asarray((scaled - scaled @ noise @ noise.T) * size) if noise.size else None


def _combinations(scaled: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squared singular values (m,) of ``scaled`` (N, m), ascending; its right singular vectors as columns (m, m)."""
    values, directions = np.linalg.eigh(scaled.T @ scaled)
    return values, directions


def _moved(bench: Bench, fit: Fit) -> Fit:
    """``fit`` after the Gauss-Newton step that is left, unless the cost rises by more than errors of the solver."""
    vector = fit.vector + fit.remaining_step
    (residual,) = bench.residuals(fit.unknowns, vector[None, :], "fit")
    if residual is None or (cost := cost_of(fit.unknowns, vector, residual)) >= fit.cost + RISEN:
        return fit
    return replace(fit, vector=vector, residual=residual, cost=cost)
