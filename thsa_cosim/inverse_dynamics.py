"""Inverse dynamics: the force that a recorded motion needs, fitted and compared without simulating.

IDIM-LS, the inverse dynamic identification model with least squares, of A. Janot, M. Gautier and M. Brunot,
"Data Set and Reference Models of EMPS" (Workshop on Nonlinear System Identification Benchmarks, 2019), after
M. Gautier and P. Poignet (Control Engineering Practice 9, 2001): the position is low-passed without phase and
differentiated; force and regressors pass the same decimation ("parallel" decimation), which takes no side; a
linear force law follows by least squares.

A simulation's output error mixes what the force law lacks with what the loop makes of it. The force residual
does not, but knows only what acts as a force.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from thsa_cosim.signals import FloatArray, Signals

_DECIMATION_ORDER, _DECIMATION_RIPPLE_DB, _DECIMATION_EDGE = 8, 0.05, 0.8
"""Chebyshev filter of type I before decimation: order, ripple, edge as a share of the new Nyquist frequency."""
_MOTION_CUTOFF = 5.0
"""The position passes below this multiple of the band, as published."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Position [m], velocity [m/s] and acceleration [m/s2] of a body, each (n,), or their rotational likes."""

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


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


def low_pass(values: FloatArray, cutoff: float, step: float, order: int = 4) -> FloatArray:
    """Butterworth filter forwards and backwards: values (n,) every ``step`` s, ``cutoff`` in Hz.

    The ends are extended oddly by three times the order, as MATLAB's ``filtfilt`` does.
    """
    from scipy import signal  # half a second to import, and few studies filter

    numerator, denominator = signal.butter(order, 2.0 * cutoff * step)
    return _zero_phase(numerator, denominator, values)


def differentiate(values: FloatArray, step: float) -> FloatArray:
    """Central differences of values (n,) every ``step`` s, one-sided at the ends."""
    return np.asarray(np.gradient(values, step))


def motion(position: FloatArray, step: float, cutoff: float) -> Motion:
    """Motion from a position (n,) every ``step`` s that is low-passed at ``cutoff`` Hz."""
    smooth = low_pass(position, cutoff, step)
    velocity = differentiate(smooth, step)
    return Motion(smooth, velocity, differentiate(velocity, step))


def decimate(values: FloatArray, factor: int) -> FloatArray:
    """Every ``factor``-th of values (n,) after a zero-phase filter; the last sample is kept, as MATLAB does."""
    if factor == 1:
        return values
    from scipy import signal  # half a second to import, and few studies filter

    edge = _DECIMATION_EDGE / factor
    filtered = _zero_phase(*signal.cheby1(_DECIMATION_ORDER, _DECIMATION_RIPPLE_DB, edge), values)
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


def force_residual(
    measured: Signals, simulated: Signals, *, position: str, force: str, mass: float, band: float
) -> Signals:
    """What a simulated force law lacks: ``F_m - F_s - M (a_m - a_s)`` below ``band`` Hz, every step of the record.

    ``position`` and ``force`` name signals of both, ``mass`` is what the force moves. The law's other forces enter
    as the simulation has them, at its own speed and position; in closed loop these differ so little from the
    measured ones that the residual is that of the law at the measured motion. The simulation is taken at the
    record's times. Two periods of the band are left out at each end, where the filters know too little.

    Raises
    ------
    ValueError
        If the record is shorter than ten periods of the band, or sampled more slowly than ten times in one.
    """
    step = float(np.median(np.diff(measured.time)))
    margin = math.ceil(2.0 / (band * step))
    span = float(measured.time[-1] - measured.time[0])
    if span * band < 10.0 or 10.0 * band * step > 1.0:
        raise ValueError(
            f"a record of {span:g} s every {step:g} s shows no residual below {band:g} Hz; choose another band."
        )
    time = measured.time[0] + step * np.arange(int(span / step) + 1)
    real, model = (s.select((position, force)).resample(time) for s in (measured, simulated))
    accelerations = (motion(s[position], step, _MOTION_CUTOFF * band).acceleration for s in (real, model))
    lacking = real[force] - model[force] - mass * np.subtract(*accelerations)
    inner = slice(margin, time.size - margin)
    residual = low_pass(lacking, band, step)[inner]
    return Signals(time[inner], {force: residual}, {force: measured.units[force]})


def repeatability(values: FloatArray, period: int) -> float:
    """Standard deviation of values (n,) about their mean lap of ``period`` samples; the last lap may be short.

    What a motion that repeats leaves to chance: no law of the motion can explain it. NaN below two laps.
    """
    if values.size < 2 * period:
        return float("nan")
    phase = np.arange(values.size) % period
    laps = np.bincount(phase)
    mean = np.bincount(phase, weights=values) / laps
    return float(np.sqrt(np.sum((values - mean[phase]) ** 2) / np.sum(laps - 1)))


def _zero_phase(numerator: FloatArray, denominator: FloatArray, values: FloatArray) -> FloatArray:
    from scipy import signal  # half a second to import, and few studies filter

    reach = 3 * (max(len(numerator), len(denominator)) - 1)
    return np.asarray(signal.filtfilt(numerator, denominator, values, padlen=min(reach, values.size - 1)))
