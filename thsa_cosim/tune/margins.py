"""Margins of a loop from its transfer function over frequency: gain, phase, bandwidth.

With L(jω) the loop opened at one signal (``fmu.linear``): the phase margin is the angle between L and -1
where |L| = 1, the gain margin the distance of |L| from 1, up or down, where L is real and negative (a load
that aids makes the plant slowly unstable: its gain must not fall too far either), and the bandwidth the
first frequency at which |L / (1 + L)| has fallen by 3 dB. The smallest of several crossings counts, and
all of them interpolate linearly over log ω. A loop that is unstable when closed has negative margins.
"""

from dataclasses import dataclass

import numpy as np

from thsa_cosim.errors import MissingExtraError
from thsa_cosim.fmu.linear import OpenLoop
from thsa_cosim.signals import FloatArray

ComplexArray = np.ndarray[tuple[int], np.dtype[np.complex128]]

#: rad/s; 50 a decade.
FREQUENCIES: FloatArray = np.logspace(-2.0, 5.0, 351)
#: A closed-loop eigenvalue with a larger real part, in 1/s, is unstable; a position drifts, and is not.
DRIFT = 1e-3


@dataclass(frozen=True)
class Margins:
    """Gain margin [dB], phase margin [deg], bandwidth [Hz]; infinite where nothing is crossed."""

    gain_margin: float
    phase_margin: float
    bandwidth: float


def margins(loop: OpenLoop, reader: str = "own") -> Margins:
    """Margins of an opened loop; ``reader`` "own" or "python-control" (ten times slower, the same numbers)."""
    read = margins_by_control if reader == "python-control" else margins_of
    found = read(FREQUENCIES, loop.response(FREQUENCIES))
    closed = loop.a + np.outer(loop.b, loop.c)
    if float(np.max(np.linalg.eigvals(closed).real)) <= DRIFT:
        return found
    return Margins(-found.gain_margin, -found.phase_margin, found.bandwidth)


def margins_of(omega: FloatArray, response: ComplexArray) -> Margins:
    """Margins of L (m,) at ``omega`` (m,) in rad/s, of a loop that is stable when closed."""
    log_gain = 20.0 * np.log10(np.abs(response))
    # The angle from -1, continuous where L crosses the unit circle far from -1.
    angle = np.degrees(np.unwrap(np.angle(-response)))
    at_unity = _crossings(log_gain)
    phase = [_at(angle, k, w) for k, w in at_unity]
    at_minus = [(k, w) for k, w in _crossings(response.imag) if _at(response.real, k, w) < 0.0]
    gain = [abs(_at(log_gain, k, w)) for k, w in at_minus]
    closed = 20.0 * np.log10(np.abs(response / (1.0 + response))) + 20.0 * np.log10(np.sqrt(2.0))
    band = [(k, w) for k, w in _crossings(closed) if closed[k] > 0.0]
    log_omega = np.log(omega)
    return Margins(
        gain_margin=min(gain, default=float("inf")),
        phase_margin=min((abs((p + 180.0) % 360.0 - 180.0) for p in phase), default=float("inf")),
        bandwidth=float(np.exp(_at(log_omega, *band[0]))) / (2.0 * np.pi) if band else float("inf"),
    )


def _crossings(values: FloatArray) -> list[tuple[int, float]]:
    """Where ``values`` (m,) change sign: index before it and the share of the interval."""
    signs = values > 0.0
    return [
        (int(k), float(values[k] / (values[k] - values[k + 1])))
        for k in np.flatnonzero(signs[1:] != signs[:-1])
    ]


def _at(values: FloatArray, k: int, share: float) -> float:
    return float(values[k] + share * (values[k + 1] - values[k]))


def margins_by_control(omega: FloatArray, response: ComplexArray) -> Margins:
    """Gain and phase margin from python-control, an independent reading of the same L; the bandwidth is ours.

    Raises MissingExtraError without the extra ``control``.
    """
    try:
        import control
    except ImportError as error:
        raise MissingExtraError("A second reading of the margins", "control") from error

    phase = np.degrees(np.unwrap(np.angle(response)))
    gains, phases, *_ = control.stability_margins((np.abs(response), phase, omega), returnall=True)
    return Margins(
        gain_margin=min((abs(20.0 * float(np.log10(g))) for g in gains), default=float("inf")),
        phase_margin=min((abs(float(p)) for p in phases), default=float("inf")),
        bandwidth=margins_of(omega, response).bandwidth,
    )
