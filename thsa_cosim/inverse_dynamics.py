"""Inverse dynamics: the force that a recorded motion needs, compared with a model's without its loops.

After IDIM-LS, the inverse dynamic identification model with least squares, of A. Janot, M. Gautier and M. Brunot,
"Data Set and Reference Models of EMPS" (Workshop on Nonlinear System Identification Benchmarks, 2019): the position
is low-passed without phase and differentiated.

A simulation's output error mixes what the force law lacks with what the loop makes of it. The force residual
does not, but knows only what acts as a force.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from thsa_cosim.signals import FloatArray, Signals

_MOTION_CUTOFF = 5.0
"""The position passes below this multiple of the band, as published."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Position [m], velocity [m/s] and acceleration [m/s2] of a body, each (n,), or their rotational likes."""

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


def low_pass(values: FloatArray, cutoff: float, step: float, order: int = 4) -> FloatArray:
    """Butterworth filter forwards and backwards: values (n,) every ``step`` s, ``cutoff`` in Hz.

    The ends are extended oddly by three times the order, as MATLAB's ``filtfilt`` does.
    """
    return zero_phase(*_butterworth(order, 2.0 * cutoff * step), values)


@lru_cache(maxsize=64)
def _butterworth(order: int, share: float) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator; a diagnosis asks hundreds of times, and designing takes as long as filtering."""
    from scipy import signal  # half a second to import, and few studies filter

    numerator, denominator = signal.butter(order, share)
    return numerator, denominator


def differentiate(values: FloatArray, step: float) -> FloatArray:
    """Central differences of values (n,) every ``step`` s, one-sided at the ends."""
    return np.asarray(np.gradient(values, step))


def motion(position: FloatArray, step: float, cutoff: float) -> Motion:
    """Motion from a position (n,) every ``step`` s that is low-passed at ``cutoff`` Hz."""
    smooth = low_pass(position, cutoff, step)
    velocity = differentiate(smooth, step)
    return Motion(smooth, velocity, differentiate(velocity, step))


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


def zero_phase(numerator: FloatArray, denominator: FloatArray, values: FloatArray) -> FloatArray:
    """Filter values (n,) forwards and backwards, its ends extended oddly by three times the order."""
    from scipy import signal  # half a second to import, and few studies filter

    reach = 3 * (max(len(numerator), len(denominator)) - 1)
    return np.asarray(signal.filtfilt(numerator, denominator, values, padlen=min(reach, values.size - 1)))
