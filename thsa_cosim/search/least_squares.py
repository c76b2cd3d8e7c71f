"""Bounded least squares by damped Gauss-Newton steps: the one that identification and diagnosis share.

Levenberg (1944), Marquardt (1963), damping after Nielsen (1999). Steps that leave the bounds are taken along
them. What is known beforehand enters as one more residual per unknown. Columns of the Jacobian can be kept.
Robust errors (Huber, absolute) use the weights ψ(r)/r far from the minimum and ψ'(r), which converges faster,
close to it. A search stops where the next step promises less than ``enough`` of the noise: a step by one
standard error lowers the cost by one unit of it, so 0.001 leaves 3 % of a standard error.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.costs.identification import ERRORS, ErrorFunction
from thsa_cosim.search.differences import Asking, Box, DifferenceSettings, difference_columns

FloatArray = NDArray[np.float64]

#: Damping of the first step, relative to the curvature; a rejected step multiplies it, an accepted one may divide it.
FIRST_DAMPING, SMALLEST_DAMPING, LARGEST_DAMPING = 1e-3, 1e-12, 1e12
#: A step that brings less than this share of the cost counts as close to the minimum.
CLOSE = 0.03


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known beforehand of the unknowns: ``mean`` (n,) and ``precision`` (n,), 1/standard deviation or 0."""

    mean: FloatArray
    precision: FloatArray


@dataclass(frozen=True)
class LeastSquaresSettings:
    """When to stop, and how to differentiate.

    ``iterations``: steps tried, whether they help or not. ``enough``: decrease of the cost, in units of the
    residuals' mean square (``absolute=True``: in the cost's own), below which a further step is not taken.
    ``trials``: dampings tried in one batch, each a hundred times the one before; more than one only pays where
    workers would idle.
    """

    iterations: int = 40
    enough: float = 1e-3
    absolute: bool = False
    error: str = "squared"
    trials: int = 1
    differences: DifferenceSettings = field(default_factory=DifferenceSettings)


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where a search ended: vector ``x`` (n,), ``residual`` (N,), ``jacobian`` (N, n) per scale, ``cost``.

    ``current`` says whether the Jacobian belongs to ``x`` (or to the vector before). ``steps`` (n,) are the
    difference steps that serve next time, ``history`` the cost after each accepted step, the start's first.
    """

    x: FloatArray
    residual: FloatArray
    jacobian: FloatArray
    current: bool
    steps: FloatArray
    cost: float
    history: tuple[float, ...]
    evaluations: int
    converged: bool
    reason: str


def least_squares(
    start: FloatArray,
    box: Box,
    settings: LeastSquaresSettings,
    *,
    prior: Prior | None = None,
    residual: FloatArray | None = None,
    jacobian: FloatArray | None = None,
    fresh: Sequence[int] | None = None,
    steps: FloatArray | None = None,
) -> Asking[Minimum | None]:
    """Minimise Σ f(r) + Σ ((x − mean) · precision)² from ``start`` (n,); None if the start fails.

    ``residual`` (N,) and ``jacobian`` (N, n) at the start are used as given; of a given Jacobian, later steps renew
    the columns ``fresh`` only (default: all). A generator: see :mod:`thsa_cosim.search.differences`.
    """
    search = _Search(box, settings, prior, fresh)
    return (yield from search.run(box.clip(start), residual, jacobian, steps))


def smooth_cost(residual: FloatArray, error: str) -> float:
    """Σ f(r) with the smooth stand-in of f; infinite where residuals (N,) are, or are absurdly large."""
    with np.errstate(over="ignore"):
        total = float(np.sum(ERRORS[error].smooth(residual)))
    return total if np.isfinite(total) else float("inf")


class _Search:
    """One descent and where it stands."""

    def __init__(
        self, box: Box, settings: LeastSquaresSettings, prior: Prior | None, fresh: Sequence[int] | None
    ) -> None:
        self.box, self.settings, self.prior, self.fresh = box, settings, prior, fresh
        self.function: ErrorFunction = ERRORS[settings.error]
        self.damping, self.grow, self.close = FIRST_DAMPING, 4.0, False
        self.evaluations = 0

    def run(
        self,
        x: FloatArray,
        residual: FloatArray | None,
        jacobian: FloatArray | None,
        steps: FloatArray | None,
    ) -> Asking[Minimum | None]:
        if residual is None:
            residual = (yield x[None, :])[0]
            self.evaluations += 1
            if residual is None or not np.isfinite(smooth_cost(residual, self.settings.error)):
                return None
        n, settings = x.size, self.settings
        steps = np.full(n, settings.differences.first) if steps is None else steps
        renew = list(range(n)) if jacobian is None or self.fresh is None else list(self.fresh)
        stale = jacobian is None
        jacobian = np.zeros((residual.size, n)) if jacobian is None else jacobian.copy()
        cost = self.cost(x, residual)
        history, converged, reason = [cost], False, "the allowed number of steps was used"
        for _ in range(settings.iterations):
            if stale:
                fresh, steps = yield from self.differentiate(x, residual, steps, renew)
                jacobian[:, renew], stale = fresh, False
            gradient, information = self.model(x, residual, jacobian)
            enough = settings.enough * (1.0 if settings.absolute else self.unit(residual))
            if self.promise(x, gradient, information) <= enough:
                converged, reason = True, "the next step promises nothing beyond the noise"
                break
            step = yield from self.step(x, cost, gradient, information)
            if step is None:
                reason = "no step lowers the cost"
                break
            x, residual, better, promised = step
            gained, cost = cost - better, better
            history.append(cost)
            stale, self.close = True, gained <= CLOSE * abs(cost)
            if gained <= enough and gained >= 0.5 * promised:
                converged, reason = True, "the cost no longer changed"
                break
        return Minimum(
            x, residual, jacobian, not stale, steps, cost, tuple(history), self.evaluations, converged, reason
        )

    def differentiate(
        self, x: FloatArray, residual: FloatArray, steps: FloatArray, columns: list[int]
    ) -> Asking[tuple[FloatArray, FloatArray]]:
        """`difference_columns`, with the vectors counted."""
        asking = difference_columns(x, residual, steps, self.box, self.settings.differences, columns)
        vectors = next(asking)
        while True:
            self.evaluations += len(vectors)
            try:
                vectors = asking.send((yield vectors))
            except StopIteration as stop:
                found: tuple[FloatArray, FloatArray] = stop.value
                return found

    def cost(self, x: FloatArray, residual: FloatArray) -> float:
        """Σ f(r), with the smooth stand-in of f, and the prior's squares."""
        total = smooth_cost(residual, self.settings.error)
        if self.prior is not None:
            total += float(np.sum(((x - self.prior.mean) * self.prior.precision) ** 2))
        return total

    def unit(self, residual: FloatArray) -> float:
        """By how much the cost rises one standard error off its minimum, for white residuals."""
        slope = float(np.mean(self.function.slope(residual)))
        return float(np.mean(self.function.psi(residual) ** 2)) / max(slope, 1e-12)

    def model(
        self, x: FloatArray, residual: FloatArray, jacobian: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Half the gradient (n,) and the Gauss-Newton half of the second derivative (n, n), per scale."""
        psi = self.function.psi(residual)
        gradient = jacobian.T @ psi
        if self.function.name == "squared":
            information = jacobian.T @ jacobian
        else:
            slope = self.function.slope(residual)
            weight = np.divide(psi, residual, out=np.ones_like(psi), where=np.abs(residual) > 1e-12)
            if self.close:
                # Where next to nothing is left of the slope, the weights keep the step bounded.
                weight = np.maximum(slope, 1e-3 * weight)
            information = (jacobian * weight[:, None]).T @ jacobian
        if self.prior is not None:
            precision = self.prior.precision * self.box.scale
            gradient = gradient + (x - self.prior.mean) * self.prior.precision * precision
            information = information + np.diag(precision**2)
        return gradient, information

    def promise(self, x: FloatArray, gradient: FloatArray, information: FloatArray) -> float:
        """Decrease of the cost that the undamped step within the bounds promises."""
        step = self.bounded(x, gradient, information, 1e-12)
        return _decrease(step, gradient, information)

    def bounded(
        self, x: FloatArray, gradient: FloatArray, information: FloatArray, damping: float
    ) -> FloatArray:
        """The damped step (n,), per scale, that keeps to the bounds: what would leave them stays on them."""
        diagonal = np.diag(information).copy()
        diagonal[diagonal <= 0.0] = 1.0
        matrix = information + damping * np.diag(diagonal)
        size = np.sqrt(diagonal)
        low, high = (self.box.lower - x) / self.box.scale, (self.box.upper - x) / self.box.scale
        step, free = np.zeros(x.size), np.ones(x.size, dtype=np.bool_)
        while free.any():
            wanted = -gradient[free] - matrix[np.ix_(free, ~free)] @ step[~free]
            # Scaled to a unit diagonal, and without directions in which nothing responds.
            scaled = matrix[np.ix_(free, free)] / np.outer(size[free], size[free])
            step[free] = np.linalg.lstsq(scaled, wanted / size[free], rcond=1e-13)[0] / size[free]
            out = free & ((step < low) | (step > high))
            if not out.any():
                break
            # The one that is furthest out, relative to its way, goes onto its bound first.
            beyond = np.where(
                out, np.maximum(step - high, low - step) / np.maximum(np.abs(step), 1e-300), 0.0
            )
            j = int(np.argmax(beyond))
            step[j], free[j] = np.clip(step[j], low[j], high[j]), False
        return np.clip(step, low, high)

    def step(
        self, x: FloatArray, cost: float, gradient: FloatArray, information: FloatArray
    ) -> Asking[tuple[FloatArray, FloatArray, float, float] | None]:
        """The next vector, its residuals, its cost and the decrease that was promised; None if nothing helps."""
        for _ in range(12):
            dampings = [self.damping * 100.0**k for k in range(self.settings.trials)]
            moves = [self.bounded(x, gradient, information, d) for d in dampings]
            if float(np.max(np.abs(moves[0]))) < 1e-9:
                return None
            trials = self.box.clip(x + np.array(moves) * self.box.scale)
            found = yield trials
            self.evaluations += len(trials)
            costs = [self.cost(v, r) if r is not None else np.inf for v, r in zip(trials, found, strict=True)]
            best = int(np.argmin(costs))
            residual = found[best]
            promised = _decrease(moves[best], gradient, information)
            if costs[best] < cost and residual is not None:
                ratio = (cost - costs[best]) / max(promised, 1e-300)
                self.damping = max(
                    SMALLEST_DAMPING, dampings[best] * max(0.1, 1.0 - (2.0 * min(ratio, 1.0) - 1.0) ** 3)
                )
                self.grow = 4.0
                return trials[best], residual, costs[best], promised
            self.damping = min(LARGEST_DAMPING, max(dampings[-1], 1e-4) * self.grow)
            self.grow *= 2.0
        return None


def _decrease(step: FloatArray, gradient: FloatArray, information: FloatArray) -> float:
    return float(-2.0 * gradient @ step - step @ information @ step)
