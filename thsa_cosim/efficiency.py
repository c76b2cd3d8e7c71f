"""Efficiency of a permanent-magnet motor from its identified parameters."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def motor_efficiency(
    torque: ArrayLike,
    speed: ArrayLike,
    *,
    resistance: float,
    torque_constant: float,
    coulomb: float,
    viscous: float,
) -> NDArray[np.float64]:
    """Shaft power over electrical power at constant speed; NaN where the motor does not drive.

    ``torque`` [N.m] at the shaft and ``speed`` [rad/s] broadcast against each other. Losses are the copper's,
    R_s i_q² (equation 2 of the article), and the motor's Coulomb [N.m] and viscous [N.m/(rad/s)] friction;
    ``resistance`` in ohm, ``torque_constant`` K_t = √(3/2) p ψ_pm in N.m/A (equation 4), power-invariant frame.
    """
    m, w = np.broadcast_arrays(np.asarray(torque, dtype=np.float64), np.asarray(speed, dtype=np.float64))
    current = (m + coulomb * np.sign(w) + viscous * w) / torque_constant
    electrical = resistance * current**2 + torque_constant * w * current
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(m * w > 0.0, m * w / electrical, np.nan))
