"""Tuning: a command and the conditions it must serve under → gains, and a schedule of them.

``run``         the use case as a function
``problem``     scenario → experiments, and the groups of conditions that share gains
``response``    what a worker makes of one response: its terms
``margins``     gain margin, phase margin and bandwidth of the opened loop
``combine``     terms over conditions → one cost, with hard and soft requirements
``samples``     parameter samples from an identification's covariance
``evaluate``    sets of gains under all conditions, term by term
``population``  the population's path, and the line it draws towards
``pareto``      non-dominated gains
``schedule``    gains over conditions: smoothing and interpolation
``results``     what comes out
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from thsa_cosim.tune.results import (
        GroupResult,
        Pareto,
        ScheduleCheck,
        ScheduleResult,
        Scored,
        Surface,
        TuneResult,
    )
    from thsa_cosim.tune.run import tune
    from thsa_cosim.tune.schedule import GainSchedule

__all__ = [
    "GainSchedule",
    "GroupResult",
    "Pareto",
    "ScheduleCheck",
    "ScheduleResult",
    "Scored",
    "Surface",
    "TuneResult",
    "tune",
]


def __getattr__(name: str) -> Any:
    """Import a name of this room when it is first asked for: a worker needs ``response`` alone."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    room = {"tune": "run", "GainSchedule": "schedule"}.get(name, "results")
    return getattr(import_module(f"{__name__}.{room}"), name)
