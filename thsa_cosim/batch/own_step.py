"""FMUs that step by themselves: fixed-step code (20-sim, Simulink) that does whole steps of its own at every call.

Communication steps shorter than that show each value several times, and early by up to one own step. They are no more
exact than longer ones, so nothing may be compared with them.
"""

from collections.abc import Mapping

import numpy as np

from thsa_cosim.signals import FloatArray

_FEWEST = 10
"""Changes of an output below which it tells nothing."""


def own_step(time: FloatArray, values: Mapping[str, FloatArray]) -> float | None:
    """Return the step [s] at which most outputs change in a run with communication points ``time`` (n,) s.

    None if they change at every communication point, or hardly ever.
    """
    spacings = []
    for signal in values.values():
        changes = np.flatnonzero(np.diff(signal))
        if changes.size >= _FEWEST:
            spacings.append(float(np.median(np.diff(changes))))
    if not spacings:
        return None
    typical = float(np.median(spacings))
    return typical * float(np.median(np.diff(time))) if typical >= 2.0 else None
