"""IDIM-LS, by which the published coefficients of EMPS were found: a linear force law by least squares.

A. Janot, M. Gautier and M. Brunot (Workshop on Nonlinear System Identification Benchmarks, 2019), after M. Gautier
and P. Poignet (Control Engineering Practice 9, 2001): force and regressors pass the same decimation ("parallel"
decimation), which takes no side.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import signal

from thsa_cosim.inverse_dynamics import Motion, zero_phase
from thsa_cosim.signals import FloatArray

_DECIMATION_ORDER, _DECIMATION_RIPPLE_DB, _DECIMATION_EDGE = 8, 0.05, 0.8
"""Chebyshev filter of type I before decimation: order, ripple, edge as a share of the new Nyquist frequency."""


@dataclass(frozen=True, eq=False)
class ForceFit:
    """Coefficients of a force law by name, in the force's unit per regressor's.

    ``stderr`` holds for white residuals, as published; it is too small where they are correlated in time.
    ``relative_error`` is the norm of the residual over that of the force.
    """

    coefficients: Mapping[str, float]
    stderr: Mapping[str, float]
    relative_error: float

    def force(self, regressors: Mapping[str, FloatArray]) -> FloatArray:
        """The law's force (n,) for regressors (n,) of the same names."""
        parts = [value * regressors[name] for name, value in self.coefficients.items()]
        return np.asarray(np.sum(parts, axis=0))


def decimate(values: FloatArray, factor: int) -> FloatArray:
    """Every ``factor``-th of values (n,) after a zero-phase filter; the last sample is kept, as MATLAB does."""
    if factor == 1:
        return values
    edge = _DECIMATION_EDGE / factor
    filtered = zero_phase(*signal.cheby1(_DECIMATION_ORDER, _DECIMATION_RIPPLE_DB, edge), values)
    return filtered[(values.size - 1) % factor :: factor]


def symmetric_law(body: Motion) -> dict[str, FloatArray]:
    """Regressors (n,) of M a + F_v v + F_c sgn(v) + F_0."""
    return {
        "M": body.acceleration,
        "F_v": body.velocity,
        "F_c": np.sign(body.velocity),
        "F_0": np.ones_like(body.velocity),
    }


def asymmetric_law(body: Motion) -> dict[str, FloatArray]:
    """Regressors (n,) of M a + F_v± v + F_c±: friction of its own for each direction; F_c- counts positive."""
    ahead, back = (body.velocity > 0.0).astype(np.float64), (body.velocity < 0.0).astype(np.float64)
    return {
        "M": body.acceleration,
        "F_v+": body.velocity * ahead,
        "F_v-": body.velocity * back,
        "F_c+": ahead,
        "F_c-": -back,
    }


def fit_force(
    force: FloatArray,
    regressors: Mapping[str, FloatArray],
    *,
    samples: slice = slice(None),
    factor: int = 1,
) -> ForceFit:
    """Least squares of ``force`` (n,) on ``regressors`` (n,), of which ``samples`` are decimated alike.

    Filtered derivatives are wrong at the ends of a record: leave them out by ``samples``.

    Raises
    ------
    ValueError
        If there are no more samples than regressors, or the samples do not tell regressors apart.
    """
    matrix = np.column_stack([decimate(column[samples], factor) for column in regressors.values()])
    wanted = decimate(force[samples], factor)
    rows, unknowns = matrix.shape
    if rows <= unknowns:
        raise ValueError(f"{rows} samples are too few for {unknowns} regressors; use a longer record.")
    scale = np.linalg.norm(matrix, axis=0)
    if not (scale > 0.0).all() or np.linalg.cond(matrix / scale) > 1e10:
        raise ValueError(f"the samples do not tell {', '.join(regressors)} apart; leave one out.")
    found = np.linalg.lstsq(matrix, wanted, rcond=None)[0]
    residual = wanted - matrix @ found
    stderr = np.std(residual, ddof=1) * np.sqrt(np.diag(np.linalg.inv(matrix.T @ matrix)))
    return ForceFit(
        dict(zip(regressors, found.tolist(), strict=True)),
        dict(zip(regressors, stderr.tolist(), strict=True)),
        float(np.linalg.norm(residual) / np.linalg.norm(wanted)),
    )
