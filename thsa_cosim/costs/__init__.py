"""Costs: pure functions on arrays, from measured and simulated signals to numbers.

``metrics``
    what a servo engineer reads off a response: rmse, rise time, steady-state error, overshoot.
``identification``
    the cost of an identification, equation 6 of the article.
``control``
    the cost of a control law, equation 7 of the article.
``channels``
    a measured signal to be met, and what a worker sends back instead of whole signals.
"""

from thsa_cosim.costs.channels import Channel, ResidualReducer, TermsReducer
from thsa_cosim.costs.control import ControlCost, control_cost
from thsa_cosim.costs.identification import (
    ERRORS,
    ErrorFunction,
    error_terms,
    influence,
    window_mask,
)
from thsa_cosim.costs.metrics import (
    first_reach,
    nrmse,
    overshoot,
    rise_time,
    rmse,
    settling_time,
    signal_range,
    steady_state_error,
)

__all__ = [
    "ERRORS",
    "Channel",
    "ControlCost",
    "ErrorFunction",
    "ResidualReducer",
    "TermsReducer",
    "control_cost",
    "error_terms",
    "first_reach",
    "influence",
    "nrmse",
    "overshoot",
    "rise_time",
    "rmse",
    "settling_time",
    "signal_range",
    "steady_state_error",
    "window_mask",
]
