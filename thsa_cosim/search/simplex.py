"""Nelder and Mead's simplex (The Computer Journal 7 (1965) 308) in the unit cube, from the end of a global search.

A cost with requirements has edges: least squares and gradients stop there, and differential evolution with a small
mutation factor narrows before it has slid along them. SciPy's simplex does the work; it starts anew until that no
longer pays, since a simplex that has collapsed against an edge is no minimum.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class SimplexSettings:
    """``size``: edge of a simplex at its start, share of the cube; ``width``: that of one that has converged.

    ``enough``: a start anew pays where it lowers the cost by this share at least; ``starts`` at most.
    ``evaluations``: at most, for each start.
    """

    size: float = 0.02
    width: float = 1e-4
    enough: float = 1e-4
    starts: int = 4
    evaluations: int = 100

    def usual(self, dimension: int) -> int:
        """Evaluations that a descent in so many directions takes as a rule: two starts."""
        return min(90 * dimension, 2 * self.evaluations)


@dataclass(frozen=True)
class SimplexResult:
    """The best vector ``best`` (n,) with its ``cost``; never worse than the start."""

    best: FloatArray
    cost: float
    evaluations: int


def descend(
    evaluate: Callable[[FloatArray], FloatArray], start: FloatArray, cost: float, settings: SimplexSettings
) -> SimplexResult:
    """Minimise ``evaluate`` from ``start`` (n,) in [0, 1]^n, whose cost is ``cost``.

    ``evaluate`` takes vectors (m, n) and returns their costs (m,); NaN counts as +inf.
    """
    from scipy.optimize import minimize  # slow to import

    best, least, evaluations = start, cost, 0

    def cost_of(vector: FloatArray) -> float:
        nonlocal evaluations
        if np.array_equal(vector, best):
            return least
        evaluations += 1
        found = float(evaluate(vector[None, :])[0])
        return np.inf if np.isnan(found) else found

    for _ in range(settings.starts):
        before = least
        # Towards the inside, so that no edge of the simplex is cut off by the cube.
        inward = np.where(best > 0.5, -settings.size, settings.size)
        with np.errstate(invalid="ignore"):  # while some costs are infinite, SciPy computes inf - inf
            found = minimize(
                cost_of,
                best,
                method="Nelder-Mead",
                bounds=[(0.0, 1.0)] * best.size,
                options={
                    "initial_simplex": np.vstack([best, best + np.diag(inward)]),
                    "xatol": settings.width,
                    "fatol": 0.1 * settings.enough * abs(before),
                    "maxfev": settings.evaluations,
                },
            )
        if found.fun < least:
            best, least = np.asarray(found.x, dtype=np.float64), float(found.fun)
        if not before - least > settings.enough * abs(before):
            break
    return SimplexResult(best, least, evaluations)
