"""FMUs that step by themselves: fixed-step code (20-sim, Simulink) that does whole steps of its own at every call.

Communication steps shorter than that show each value several times, and early by up to one own step. They are no more
exact than longer ones, so nothing may be compared with them.
"""

from collections.abc import Mapping

import numpy as np

from thsa_cosim.fmu import FmuDescription
from thsa_cosim.fmu.inputs import input_variables, is_linear
from thsa_cosim.signals import FloatArray, Signals

_FEWEST = 10
"""Changes of an output below which it tells nothing."""


def own_step(time: FloatArray, values: Mapping[str, FloatArray]) -> float | None:
    """Return the step [s] at which outputs change in a run with communication points ``time`` (n,) s.

    None if one of them changes at every communication point, or all hardly ever. Where inputs are held from sample to
    sample, that may be theirs: then this tells nothing (``moves_within``).
    """
    spacings = []
    for signal in values.values():
        changes = np.flatnonzero(np.diff(signal))
        if changes.size >= _FEWEST:
            spacings.append(float(np.median(np.diff(changes))))
    if not spacings:
        return None
    fewest = min(spacings)
    return fewest * float(np.median(np.diff(time))) if fewest >= 2.0 else None


def moves_within(description: FmuDescription, inputs: Signals | None) -> bool:
    """Whether inputs make an FMU move between their samples: there are none, or one runs linearly."""
    if inputs is None:
        return True
    return any(is_linear(inputs, variable) for variable in input_variables(description, inputs))
