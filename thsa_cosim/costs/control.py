"""The cost of a control law, equation 7 of the article: J = Σ_k ½ (v - v̂)² + κ1 t_r + κ2 e_ss."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.costs.metrics import first_reach, overshoot, rise_time, steady_state_error

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ControlCost:
    """A control law's cost and the terms it is made of; ``total`` is +inf when a term is undefined."""

    total: float
    tracking: float
    rise_time: float
    steady_state_error: float
    overshoot: float


def control_cost(
    time: FloatArray,
    response: FloatArray,
    command: FloatArray,
    *,
    kappa_rise: float,
    kappa_steady: float,
    window: tuple[float, float],
    fraction: float = 0.95,
    low: float | None = None,
    start: float | None = None,
    scale: float = 1.0,
    signed: bool = False,
) -> ControlCost:
    """Equation 7 for ``response`` to ``command``, both (n,) in one unit, over ``time`` (n,) in s.

    ``scale`` divides the velocity error (the article works in mm/s: 1e-3 for signals in m/s), κ1 and κ2
    weigh the rise time in s and e_ss; e_ss enters by its size, for its sign carries no merit (``signed``
    takes it as the article prints it, which rewards running too fast). The rise time is the first reach of
    ``fraction`` of the command's last value, counted from ``start``, or from the first reach of ``low``.
    """
    final = float(command[-1])
    tracking = float(np.sum(0.5 * ((command - response) / scale) ** 2))
    if low is None:
        rise = first_reach(time, response, final, fraction, start=start)
    else:
        rise = rise_time(time, response, final, low=low, high=fraction, start=start)
    steady = steady_state_error(time, response, command, window)
    total = tracking + kappa_rise * rise + kappa_steady * (steady if signed else abs(steady))
    return ControlCost(
        total=total if np.isfinite(total) else float("inf"),
        tracking=tracking,
        rise_time=rise,
        steady_state_error=steady,
        overshoot=overshoot(response, final),
    )
