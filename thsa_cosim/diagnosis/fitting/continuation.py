"""A fit that keeps step where friction sticks and slips: residuals smoothed in time first, then less and less.

A breakaway that the model makes a little too early or too late leaves two spikes that say nothing of each other, and
Gauss-Newton on the free run sees no slope towards the right time. Smoothed over more than their distance, they do:
continuation from coarse to fine, as in seismic inversion (C. Bunks et al., Geophysics 60 (1995) 1457).
"""

import numpy as np

from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.signals import FloatArray

#: Widths of the Gaussian that residuals are smoothed by, one after the other [s]: from the time between two events of
#: stick-slip at creep to that of one.
WIDTHS = (0.3, 0.1, 0.03)
#: Iterations at each width, and at last without smoothing.
ITERATIONS, LAST = 4, 8


def refine_from_coarse(
    bench: Bench, unknowns: Unknowns, vector: FloatArray, widths: tuple[float, ...] = WIDTHS
) -> Fit | None:
    """Minimise as `refine` does, from ``vector`` (n,), by way of smoothed residuals; None if it cannot be simulated."""
    for width in widths:
        with bench.smoothed(width):
            fit = refine(bench, unknowns, vector, iterations=ITERATIONS)
        if fit is None:
            return None
        vector = np.asarray(fit.vector)
    return refine(bench, unknowns, vector, iterations=LAST)
