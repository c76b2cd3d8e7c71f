"""The frequency response of a loop that is closed, measured by simulation: of sampled and coupled systems, too.

A periodic multisine d is added to one connection of the running system (``disturbance`` of the connection). With u the
connection's target, S = U / D is the sensitivity there and L = 1/S - 1 the loop transfer function, negative feedback
counted positive (Pintelon and Schoukens, *System Identification*, 2012, chapter 2; the method of a servo analyser). At
an input of a sampled controller, read at its ticks, this is the loop transfer function of the sampled system itself,
delay and hold included, with no model of either.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.plant import Plant
from thsa_cosim.signals import FloatArray, Signals

ComplexArray = np.ndarray[tuple[int], np.dtype[np.complex128]]

PERIODS = 3
"""Of the multisine: one to settle, two to measure."""
UNSETTLED = 0.05
"""Relative difference of two periods from which on the loop counts as not settled, or unstable."""


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """L(jω) of a loop: ``omega`` (m,) in rad/s, ``response`` (m,).

    ``distortion``: power at harmonics that were not excited over the power at those that were, as an amplitude ratio;
    far below 1 where the system is linear at this amplitude. ``periodicity``: relative difference of the two periods
    that were measured.
    """

    omega: FloatArray
    response: ComplexArray
    distortion: float
    periodicity: float


def multisine(time: FloatArray, period: float, harmonics: FloatArray, amplitude: float) -> FloatArray:
    """Sum of cosines (n,) with Schroeder's phases; ``amplitude`` is its largest value."""
    phases = -np.pi * np.arange(len(harmonics)) * np.arange(1, len(harmonics) + 1) / len(harmonics)
    total = np.cos(2.0 * np.pi * np.outer(time / period, harmonics) + phases).sum(axis=1)
    return np.asarray(amplitude * total / np.max(np.abs(total)))


def odd_harmonics(period: float, interval: float, count: int = 40) -> FloatArray:
    """Odd harmonics, about ``count``, evenly over the logarithm from 1 to nine tenths of the Nyquist frequency."""
    highest = 0.45 * period / interval
    drawn = 2.0 * np.round(0.5 * (np.geomspace(1.0, max(highest, 3.0), count) - 1.0)) + 1.0
    return np.unique(drawn[drawn <= highest])


def loop_response(
    plant: Plant,
    values: Mapping[str, float],
    inputs: Signals,
    *,
    target: str,
    disturbance: str,
    at: float,
    interval: float,
    amplitude: float,
    period: float = 1.0,
    tolerance: float | None = None,
) -> FrequencyResponse:
    """Measure the loop at the input variable ``target``, to which the input ``disturbance`` is added.

    Parameters
    ----------
    values, inputs, tolerance
        Start values and input signals as for ``Plant.run``; the inputs hold their last value to the end.
    at
        s; the operating point: the system is in steady motion from here on.
    interval
        s; sampling interval of the controller that reads ``target`` (of a continuous system: a twentieth of the
        shortest time constant that matters).
    amplitude
        Largest value of the disturbance, in the target's unit; small against what makes the system nonlinear.
    period
        s; its inverse is the lowest frequency, and the resolution.

    Raises
    ------
    SimulationFailure
        If a run fails, or the response does not become periodic: the closed loop is unstable, or not settled.
    """
    samples = round(period / interval)
    first = round(at / interval)
    time: FloatArray = interval * np.arange(first + PERIODS * samples + 1, dtype=np.float64)
    drive = multisine(time - time[first], period, odd_harmonics(period, interval), amplitude)
    drive[:first] = 0.0
    unit = plant.description.variable(target).unit or "1"
    disturbed = []
    for d in (drive, np.zeros_like(drive)):
        sampled = inputs.resample(time)
        signals = Signals(
            time, {**dict(sampled.values), disturbance: d}, {**dict(inputs.units), disturbance: unit}
        )
        disturbed.append(plant.run(values, signals, [target], time, tolerance=tolerance)[target])
    change = disturbed[0] - disturbed[1]
    begin = first + (PERIODS - 2) * samples
    one, other = change[begin : begin + samples], change[begin + samples : begin + 2 * samples]
    periodicity = float(np.linalg.norm(other - one) / max(float(np.linalg.norm(one)), 1e-300))
    if not periodicity < UNSETTLED:
        raise SimulationFailure(
            Status.NOT_FINITE,
            f"the response at {target} differs by {periodicity:.0%} between two periods: the closed loop is unstable,"
            " or has not settled; begin later or take a longer period",
        )
    spectrum = np.fft.rfft(0.5 * (one + other))
    driven = np.fft.rfft(drive[begin : begin + samples])
    lines = odd_harmonics(period, interval).astype(int)
    rest = np.setdiff1d(np.arange(1, lines[-1] + 1), lines)
    power = float(np.sum(np.abs(spectrum[lines]) ** 2))
    omega = 2.0 * np.pi * lines / period
    return FrequencyResponse(
        omega,
        driven[lines] / spectrum[lines] - 1.0,
        float(np.sqrt(np.sum(np.abs(spectrum[rest]) ** 2) / max(power, 1e-300))),
        periodicity,
    )
