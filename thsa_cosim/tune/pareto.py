"""Which of many vectors are not beaten in two terms at once."""

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.signals import FloatArray


def front(x: FloatArray, y: FloatArray) -> NDArray[np.intp]:
    """Indices of the non-dominated points of ``x``, ``y`` (m,), both to be small, in rising order of ``x``.

    Points with a number that is not finite are left out; of equal points the first is kept.
    """
    usable = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    order = usable[np.lexsort((y[usable], x[usable]))]
    kept, lowest = [], np.inf
    for k in order.tolist():
        if y[k] < lowest:
            kept.append(k)
            lowest = float(y[k])
    return np.array(kept, dtype=np.intp)
