"""Metrics of a response to a command: each with its unit, the excess that counts as 1, and its number.

A further metric is a row of ``RESPONSE_METRICS`` and an entry of ``response_metrics``.
"""

from collections.abc import Mapping

import numpy as np

from thsa_cosim.costs.control import control_cost
from thsa_cosim.costs.metrics import settling_time
from thsa_cosim.signals import FloatArray

#: Name → unit ("": that of the cost), and the excess over a requirement that counts as 1.
RESPONSE_METRICS: Mapping[str, tuple[str, float]] = {
    "rise_time": ("s", 0.1),
    "steady_state_error": ("1", 1e-3),
    "overshoot": ("1", 0.01),
    "settling_time": ("s", 0.1),
    "tracking_error": ("", 1.0),
}


def response_metrics(
    time: FloatArray,
    response: FloatArray,
    command: FloatArray,
    *,
    begin: float,
    window: tuple[float, float],
    fraction: float,
    low: float | None,
    band: float,
    scale: float,
    ends_at_most: bool = True,
) -> dict[str, float]:
    """The tracking term of equation 7 and every metric, of ``response`` (n,) to ``command`` (n,) over ``time`` (n,) s.

    Velocity errors are in units of ``scale``, times in s, the steady-state error and the overshoot are shares of the
    final command. Without ``ends_at_most`` (the command ends below its peak) rise, overshoot and settling are NaN.
    """
    cost = control_cost(
        time, response, command, kappa_rise=0.0, kappa_steady=0.0, window=window, fraction=fraction, low=low,
        start=begin, scale=scale,
    )  # fmt: skip
    settled = settling_time(time, response, float(command[-1]), band, start=begin)
    rise, over, settled = (cost.rise_time, cost.overshoot, settled) if ends_at_most else (np.nan,) * 3
    found = {
        "tracking": cost.tracking,
        "rise_time": rise,
        "steady_state_error": cost.steady_state_error,
        "overshoot": over,
        "settling_time": settled,
        "tracking_error": float(np.max(np.abs(command - response))) / scale,
    }
    return {name: found[name] for name in ("tracking", *RESPONSE_METRICS)}
