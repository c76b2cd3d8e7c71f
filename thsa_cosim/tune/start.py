"""The start from rest after a soak: when something moves, what current that takes, what the drive has left."""

from typing import TYPE_CHECKING

import numpy as np

from thsa_cosim.costs import first_reach
from thsa_cosim.signals import Signals

if TYPE_CHECKING:
    from thsa_cosim.scenario.metrics_schema import StartTable

MOVED = 1e-3
"""Share of the largest value below which the last one is rest: the signal then did not stay in motion."""


def start_terms(spec: "StartTable", signals: Signals, output: str, begin: float) -> list[float]:
    """The terms that ``spec`` names, from one run; NaN for those of a start that does not come.

    ``output`` is the signal that must move; ``begin`` in s is when the command starts. Breakaway current is the
    current, by its size, when the output reaches the share ``spec.moving`` of its last value: the motor has then
    overcome Coulomb friction of all elements and the load, and accelerates. With a slow ramp it is the static one.
    """
    moved, current = signals[output], np.abs(signals[spec.current])
    last = float(moved[-1])
    still = abs(last) <= MOVED * float(np.max(np.abs(moved)))
    started = float("nan") if still else first_reach(signals.time, moved, last, spec.moving, start=begin)
    margin = breakaway = float("nan")
    if np.isfinite(started):
        breakaway = float(np.interp(begin + started, signals.time, current))
        margin = spec.current_limit / breakaway - 1.0 if breakaway > 0.0 else float("inf")
    found = [started, breakaway, margin, 1.0 - float(np.max(current)) / spec.current_limit]
    if spec.voltage is not None and spec.voltage_limit is not None:
        found.append(1.0 - float(np.max(np.abs(signals[spec.voltage]))) / spec.voltage_limit)
    return found
