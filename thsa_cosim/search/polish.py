"""Local polish in the unit cube: bounded least squares, then the Jacobian that standard errors need.

The way down uses one-sided differences; the minimum itself is confirmed, and if need be corrected, with central
ones, whose own error is found by halving their steps. Where that is large, wider steps are tried: an FMU whose solver
chooses its own steps jumps from one vector to the next, by as much however small the difference step.
"""

from dataclasses import dataclass, field, replace
from itertools import pairwise

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

_DOUBT = 0.1
"""Share of a column that half the step may change."""
_WIDER = (4.0, 16.0)
_WIDEST = 0.1
"""Times the step, and share of the bounds at most, where it may not."""


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

    ``jacobian_error`` (N, n) is what another difference step changed in the Jacobian: its own uncertainty. ``residual``
    and the Jacobians are None when the start could not be simulated.
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
    fine, steps = finer.jacobian.copy(), finer.steps
    if not finer.current:
        fine, _ = yield from difference_columns(finer.x, finer.residual, steps, box, central)
        evaluations += 2 * found.x.size
    # The same again with half the steps shows how far the differences can be trusted.
    half, _ = yield from difference_columns(finer.x, finer.residual, 0.5 * steps, box, central)
    evaluations += 2 * found.x.size
    doubtful = np.flatnonzero(np.linalg.norm(half - fine, axis=0) > _DOUBT * np.linalg.norm(fine, axis=0))
    error, wider = half - fine, list[tuple[FloatArray, FloatArray]]()
    for times in _WIDER if doubtful.size else ():
        wide = np.minimum(times * steps, _WIDEST)
        columns, _ = yield from difference_columns(
            finer.x, finer.residual, wide, box, central, doubtful.tolist()
        )
        evaluations += 2 * doubtful.size
        wider.append((wide, columns))
    for k, j in enumerate(doubtful.tolist()):
        tried = [(0.5 * steps[j], half[:, j]), (steps[j], fine[:, j])]
        tried += [(float(wide[j]), columns[:, k]) for wide, columns in wider]
        fine[:, j], error[:, j] = _steadiest(tried)
    converged = finer.converged or found.converged
    reason = finer.reason if finer.converged else found.reason
    return PolishResult(finer.x, finer.residual, fine, error, evaluations, converged, reason)


def _steadiest(tried: list[tuple[float, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """Of columns (N,) by growing steps, the one that agrees best with the one before, and how far it can be trusted.

    Noise of the solver makes small steps disagree, curvature large ones. Where neighbours agree to ``_DOUBT`` of
    their size, the first ones that do are taken. Noise falls with the step: what two columns differ by is then the
    error of the smaller step.
    """
    columns = [column for _, column in tried]
    apart = [float(np.linalg.norm(b - a)) for a, b in pairwise(columns)]
    sizes = [float(np.linalg.norm(b)) for b in columns[1:]]
    good = [
        k for k, (a, size) in enumerate(zip(apart, sizes, strict=True)) if size > 0.0 and a < _DOUBT * size
    ]
    usable = [k for k, size in enumerate(sizes) if size > 0.0] or [0]
    best = good[0] if good else min(usable, key=lambda k: apart[k] / max(sizes[k], 1e-300))
    error = columns[best + 1] - columns[best]
    if best > 0 and apart[best] < 0.7 * apart[best - 1]:
        error = error * (tried[best][0] / tried[best + 1][0])
    return columns[best + 1], error
