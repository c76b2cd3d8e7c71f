"""How large signals are, and how far they travel: what a worker sends back in place of the signals of a recording."""

from dataclasses import dataclass

import numpy as np

from thsa_cosim.signals import FloatArray, Signals


@dataclass(frozen=True)
class SizesReducer:
    """Signals → largest magnitude, sum of squares, number of samples and distance travelled of each (4 k,).

    In the worker: all signals of all slots over a long recording take hundreds of megabytes. It stands in this room
    because a worker imports what it unpickles: a diagnosis takes half a second to import.
    """

    names: tuple[str, ...]

    def __call__(self, simulated: Signals) -> FloatArray:
        """Return the sizes of the named signals, in their units, one signal after the other."""
        found = [
            (np.max(np.abs(x)), x @ x, x.size, np.sum(np.abs(np.diff(x))))
            for x in (simulated[name] for name in self.names)
        ]
        return np.array(found, dtype=np.float64).ravel()
