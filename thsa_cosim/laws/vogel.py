"""A weighted fit of the Vogel-Fulcher-Tammann law."""

import numpy as np

from thsa_cosim.laws.law import FloatArray

ABSOLUTE_ZERO = -273.15
_NEAREST = 2.0
"""K, how near to the coldest temperature the pole may come."""
_STEEPEST = 25.0
"""Largest logarithm of the ratio between the coldest and the warmest value."""


def fit_vogel(t: FloatArray, y: FloatArray, sigma: FloatArray) -> FloatArray:
    """Coefficients [A, B, T0] of A exp(B / (t − T0)) through ``y`` (n,) ± ``sigma`` (n,) at ``t`` (n,) in degC.

    B ≥ 0 and T0 between absolute zero and the coldest temperature: a lubricant thickens as it cools. The search runs
    over the logarithm of the ratio of coldest to warmest value, and over T0; A follows linearly (variable projection).
    """
    from scipy.optimize import least_squares  # slow to import, and few laws need it

    cold, warm = float(np.min(t)), float(np.max(t))
    highest = cold - _NEAREST

    def shape(ratio: float, pole: float) -> FloatArray:
        """The law over its value at the warmest temperature."""
        return np.exp(_activation(ratio, pole, cold, warm) * (1.0 / (t - pole) - 1.0 / (warm - pole)))

    def amplitude(column: FloatArray) -> float:
        return float(column @ (y / sigma) / (column @ column))

    def misfit(x: FloatArray) -> FloatArray:
        column = shape(*x) / sigma
        return np.asarray(amplitude(column) * column - y / sigma)

    starts = [
        np.array([ratio, pole])
        for ratio in (0.1, 0.5, 1.0, 2.0, 4.0, 8.0)
        for pole in (highest - 3.0, highest - 20.0, highest - 60.0, 0.5 * (highest + ABSOLUTE_ZERO))
    ]
    starts.sort(key=lambda x: float(np.sum(misfit(x) ** 2)))
    bounds = ([0.0, ABSOLUTE_ZERO], [_STEEPEST, highest])
    found = [least_squares(misfit, x, bounds=bounds, x_scale=[1.0, 30.0], xtol=1e-12) for x in starts[:3]]
    ratio, pole = min(found, key=lambda f: float(f.cost)).x
    activation = _activation(ratio, pole, cold, warm)
    at_warmest = amplitude(shape(ratio, pole) / sigma)
    return np.array([at_warmest * np.exp(-activation / (warm - pole)), activation, pole])


def _activation(ratio: float, pole: float, cold: float, warm: float) -> float:
    """B in K for the logarithm of the ratio between the values at ``cold`` and ``warm``."""
    return ratio / (1.0 / (cold - pole) - 1.0 / (warm - pole))
