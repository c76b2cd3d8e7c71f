"""Local polish in the unit cube: bounded least squares, then the Jacobian that standard errors need.

The way down uses one-sided differences; the minimum itself is confirmed, and if need be corrected, with central
ones, whose own error is found by halving their steps.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from thsa_cosim.search.differences import (
    Asking,
    Box,
    DifferenceSettings,
    FloatArray,
    Residuals,
    answer,
    difference_columns,
)
from thsa_cosim.search.least_squares import LeastSquaresSettings, Minimum, least_squares


@dataclass(frozen=True)
class PolishSettings:
    """``error`` names the cost's f (``squared``, ``huber``, ``absolute``); ``iterations`` and ``enough`` as in
    `LeastSquaresSettings`.
    """

    iterations: int = 40
    enough: float = 1e-3
    error: str = "squared"
    differences: DifferenceSettings = field(default_factory=DifferenceSettings)
    final_jacobian: bool = True
    """False saves the evaluations for the Jacobians at the end, where only the minimum is wanted."""

    @property
    def least_squares(self) -> LeastSquaresSettings:
        """The same for the search."""
        return LeastSquaresSettings(
            iterations=self.iterations, enough=self.enough, error=self.error, differences=self.differences
        )


@dataclass(frozen=True, eq=False)
class PolishResult:
    """The polished vector ``best`` (n,), its residuals (N,), and the Jacobian (N, n) in the unit cube.

    ``jacobian_error`` (N, n) is what halving the difference steps changed in the Jacobian: its own
    uncertainty. ``residual`` and the Jacobians are None when the start could not be simulated.
    """

    best: FloatArray
    residual: FloatArray | None
    jacobian: FloatArray | None
    jacobian_error: FloatArray | None
    evaluations: int
    converged: bool
    reason: str


def polish(evaluate: Residuals, start: FloatArray, settings: PolishSettings) -> PolishResult:
    """Minimise Σ f(r) from ``start`` (n,) in [0, 1]^n.

    ``evaluate`` takes vectors (m, n) and returns for each its residuals (N,), weighted and dimensionless,
    or None for a simulation that failed.
    """
    box = Box.unit(start.size)
    found = answer(least_squares(start, box, settings.least_squares), evaluate)
    if found is None:
        return PolishResult(start, None, None, None, 1, False, "the vector to polish could not be simulated")
    if not settings.final_jacobian:
        return PolishResult(
            found.x, found.residual, None, None, found.evaluations, found.converged, found.reason
        )
    return answer(confirm(found, settings), evaluate)


def confirm(found: Minimum, settings: PolishSettings) -> Asking[PolishResult]:
    """Go on from a minimum with central differences, and find out how far its Jacobian can be trusted."""
    box = Box.unit(found.x.size)
    central = replace(settings.differences, central=True, share=0.0)
    # Steps that suited the way down are aimed at what the polish wants near the minimum.
    norms = np.linalg.norm(found.jacobian, axis=0)
    with np.errstate(divide="ignore"):
        steps = np.clip(central.response / norms, central.smallest, central.largest)
    finer = yield from least_squares(
        found.x,
        box,
        replace(settings.least_squares, differences=central),
        residual=found.residual,
        steps=np.asarray(steps),
    )
    assert finer is not None, "the start's residuals are known"
    evaluations = found.evaluations + finer.evaluations
    fine, steps = finer.jacobian, finer.steps
    if not finer.current:
        fine, _ = yield from difference_columns(finer.x, finer.residual, steps, box, central)
        evaluations += 2 * found.x.size
    # The same again with half the steps shows how far the differences can be trusted.
    half, _ = yield from difference_columns(finer.x, finer.residual, 0.5 * steps, box, central)
    evaluations += 2 * found.x.size
    converged = finer.converged or found.converged
    reason = finer.reason if finer.converged else found.reason
    return PolishResult(finer.x, finer.residual, fine, half - fine, evaluations, converged, reason)
