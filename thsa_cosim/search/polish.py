"""Local least-squares polish in the unit cube, with whole Jacobians evaluated as one batch.

SciPy's trust-region reflective ``least_squares`` (Branch, Coleman and Li, 1999) keeps to the bounds. The
Jacobian comes from central differences, 2n vectors in one call, so a runner's workers share them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from thsa_cosim.costs.identification import ERRORS

FloatArray = NDArray[np.float64]
Residuals = Callable[[FloatArray], Sequence[FloatArray | None]]

FIRST_STEP = 1e-3
SMALLEST_STEP = 1e-6
LARGEST_STEP = 1e-2


@dataclass(frozen=True)
class PolishSettings:
    """When to stop: after ``evaluations`` trial steps, or at a relative change of cost or step.

    ``error`` names the cost's f (``squared``, ``huber``, ``absolute``).
    """

    evaluations: int = 30
    cost_tolerance: float = 1e-8
    step_tolerance: float = 1e-7
    error: str = "squared"
    final_jacobian: bool = True
    """False saves the evaluations for the Jacobians at the end, where only the minimum is wanted."""


@dataclass(frozen=True)
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


class _Unusable(Exception):
    """No vector next to the current one can be simulated."""


def central_jacobian(
    evaluate: Residuals, x: FloatArray, centre: FloatArray, steps: FloatArray
) -> tuple[FloatArray, int]:
    """Jacobian (N, n) of the residuals at ``x`` (n,) in [0, 1]^n, and the number of evaluations.

    ``centre`` (N,) are the residuals at ``x``; steps that would leave the cube or a vector that fails
    make that direction one-sided. A direction of which both sides fail has a zero column.
    """
    n = x.size
    vectors = np.repeat(x[None, :], 2 * n, axis=0)
    for i in range(n):
        vectors[2 * i, i] = min(1.0, x[i] + steps[i])
        vectors[2 * i + 1, i] = max(0.0, x[i] - steps[i])
    results = evaluate(vectors)
    jacobian = np.zeros((centre.size, n))
    for i in range(n):
        above, below = results[2 * i], results[2 * i + 1]
        upper, lower = vectors[2 * i, i], vectors[2 * i + 1, i]
        if above is None or not np.isfinite(above).all():
            above, upper = centre, x[i]
        if below is None or not np.isfinite(below).all():
            below, lower = centre, x[i]
        if upper > lower:
            jacobian[:, i] = (above - below) / (upper - lower)
    return jacobian, 2 * n


def refined_steps(jacobian: FloatArray) -> FloatArray:
    """Difference steps (n,) that move the summed squared residual by about 100, within fixed limits.

    In units of noise that is ten conditional standard errors: far above a solver's tolerance, and still
    small against the curvature of anything that the data determine.
    """
    norms = np.linalg.norm(jacobian, axis=0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.clip(10.0 / norms, SMALLEST_STEP, LARGEST_STEP))


def polish(evaluate: Residuals, start: FloatArray, settings: PolishSettings) -> PolishResult:
    """Minimise Σ f(r) from ``start`` (n,) in [0, 1]^n.

    ``evaluate`` takes vectors (m, n) and returns for each its residuals (N,), weighted and dimensionless,
    or None for a simulation that failed.
    """
    function = ERRORS[settings.error]
    evaluations = 0
    known: dict[bytes, FloatArray] = {}
    steps = np.full(start.size, FIRST_STEP)

    def residuals_of(vectors: FloatArray) -> Sequence[FloatArray | None]:
        nonlocal evaluations
        evaluations += len(vectors)
        return evaluate(vectors)

    def residual(x: FloatArray) -> FloatArray:
        key = x.tobytes()
        if key not in known:
            values = residuals_of(x[None, :])[0]
            if values is None:
                size = next(iter(known.values())).size if known else 0
                if size == 0:
                    raise _Unusable
                return np.full(size, np.inf)  # least_squares then shortens its step
            known[key] = values
        return known[key]

    def jacobian(x: FloatArray) -> FloatArray:
        nonlocal steps
        matrix, _ = central_jacobian(residuals_of, x, residual(x), steps)
        steps = refined_steps(matrix)
        return matrix

    try:
        result = least_squares(
            residual,
            np.clip(start, 1e-9, 1.0 - 1e-9),
            jac=jacobian,
            bounds=(0.0, 1.0),
            method="trf",
            x_scale="jac",
            loss=function.smooth_loss,
            f_scale=function.smooth_width,
            ftol=settings.cost_tolerance,
            xtol=settings.step_tolerance,
            gtol=1e-12,
            max_nfev=settings.evaluations,
        )
    except _Unusable:
        reason = "the vector to polish could not be simulated"
        return PolishResult(start, None, None, None, evaluations, False, reason)
    best = np.asarray(result.x, dtype=np.float64)
    centre = residual(best)
    if not settings.final_jacobian:
        reason = _reason(int(result.status))
        return PolishResult(best, centre, None, None, evaluations, bool(result.success), reason)
    fine, _ = central_jacobian(residuals_of, best, centre, steps)
    # The same again with half the steps shows how far the differences can be trusted.
    finer, _ = central_jacobian(residuals_of, best, centre, 0.5 * steps)
    return PolishResult(
        best=best,
        residual=centre,
        jacobian=fine,
        jacobian_error=finer - fine,
        evaluations=evaluations,
        converged=bool(result.success),
        reason=_reason(int(result.status)),
    )


def _reason(status: int) -> str:
    return {
        0: "the allowed number of steps was used",
        1: "the gradient vanished",
        2: "the cost no longer changed",
        3: "the step became negligible",
        4: "neither cost nor step changed",
    }.get(status, f"least squares ended with status {status}")
