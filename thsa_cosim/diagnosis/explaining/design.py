"""What an experiment that nobody has run yet is worth: expected gains and errors, to first order.

Between rivals: what a rival still misses of the other one's outputs after all of its parameters are fitted to the
present recordings and the new one (T-optimality between models: A. Atkinson, V. Fedorov, Biometrika 62 (1975) 57).
For one model: the errors that its parameters have left (V. Fedorov, Theory of Optimal Experiments, 1972).
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from thsa_cosim.signals import FloatArray


def expected_gain(information: FloatArray, jacobian: FloatArray, difference: FloatArray) -> float:
    """Expected gap of the squared residuals between the true model and a refitted rival, in variances of the noise.

    ``information`` (n, n): of the rival's unknowns from the present recordings, the drawing's included; ``jacobian``
    (N, n): of its outputs in the experiment; ``difference`` (N,): of the true model's outputs from the rival's.
    """
    pull = jacobian.T @ difference
    together = _regular(information + jacobian.T @ jacobian)
    return max(0.0, float(difference @ difference - pull @ cho_solve(cho_factor(together), pull)))


def expected_errors(information: FloatArray, jacobian: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n,) standard errors of a model's unknowns before and after the experiment, in their scales."""
    return tuple(  # type: ignore[return-value]
        np.sqrt(np.diag(np.linalg.inv(_regular(own))))
        for own in (information, information + jacobian.T @ jacobian)
    )


def _regular(information: FloatArray) -> FloatArray:
    """With a trace on the diagonal: what nothing determines gets a large error, not an infinite one."""
    diagonal = np.diag(information)
    return np.asarray(information + np.diag(1e-9 * np.where(diagonal > 0.0, diagonal, 1.0)))
