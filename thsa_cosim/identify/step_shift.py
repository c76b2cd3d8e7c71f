"""What a foreign FMU's communication step moves the identified values by, and errors that hold it.

A fit follows the model's error as it follows a parameter: the change of the fitted signals at half the step, projected
on the parameters, is the bias of a least-squares estimate (linearised; Seber and Wild, Nonlinear Regression, ch. 2).
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from thsa_cosim.costs.channels import ResidualReducer
from thsa_cosim.identify.point import CLEAR_OF_ZERO, PointSearch
from thsa_cosim.identify.problem import PointProblem
from thsa_cosim.identify.results import Estimate, PointResult
from thsa_cosim.signals import Signals
from thsa_cosim.study import CouplingError

_WHOLE = 2.0
"""Error of the whole step over its change at half: of a method of first order, as inputs that are held make one."""


def with_shifts(coupling: CouplingError, point: PointProblem, search: PointSearch) -> CouplingError:
    """``coupling`` with its shifts: where each value would go without steps, in standard errors.

    They are projected from the first recording; the others of the point are taken to pull as much as their samples
    count. None for values whose errors are not known.
    """
    result, jacobian = search.result, search.jacobian
    if result is None or jacobian is None or not search.signals:
        return coupling
    estimates = [result.parameters[name] for name in point.space.names]
    sure = [i for i, e in enumerate(estimates) if e.stderr is not None and e.stderr > 0.0]
    simulated, reduce = search.signals[0], ResidualReducer(point.cases[0].channels)
    finer = {n: simulated[n] + coupling.differences.get(n, 0.0) for n in simulated.names}
    change = reduce(Signals(simulated.time, finer)) - reduce(simulated)
    if not sure or not np.isfinite(change).all() or not np.isfinite(jacobian[:, sure]).all():
        return coupling
    slopes = jacobian[:, sure]
    pull = slopes[: change.size].T @ change * (len(slopes) / change.size)
    moved = -_WHOLE * (np.linalg.pinv(slopes.T @ slopes, hermitian=True) @ pull)
    values = np.array([e.value for e in estimates])
    scale = point.space.slope(point.space.unit(values))[sure]
    errors = np.array([estimates[i].stderr or np.inf for i in sure])
    shifts = (moved * scale / errors).tolist()
    return replace(coupling, shifts={point.space.names[i]: s for i, s in zip(sure, shifts, strict=True)})


def widened(result: PointResult, shifts: Mapping[str, float]) -> PointResult:
    """``result`` with the shifts added to the standard errors in quadrature."""
    parameters = {n: _widened(e, shifts.get(n, 0.0)) for n, e in result.parameters.items()}
    return replace(result, parameters=parameters)


def _widened(estimate: Estimate, shift: float) -> Estimate:
    if estimate.stderr is None:
        return estimate
    stderr = estimate.stderr * float(np.hypot(1.0, shift))
    wide = replace(estimate, stderr=stderr)
    if not estimate.identifiable or CLEAR_OF_ZERO * stderr <= abs(estimate.value):
        return wide
    reason = (
        f"it cannot be distinguished from zero: one standard error is {stderr:.2g} {estimate.unit}, with what"
    )
    return replace(wide, identifiable=False, reason=f"{reason} the communication step may move it by")
