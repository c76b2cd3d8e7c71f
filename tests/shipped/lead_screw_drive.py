"""A vertical lead screw that locks itself: recordings that share nothing with its Modelica model.

The thread's law by lead angle and friction coefficient (Vahid-Araghi and Golnaraghi, Friction-Induced Vibration in Lead
Screw Drives, 2011, chapter 4), the nut's load with the payload's acceleration, stick by force balance, a speed loop.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

STEP, SAMPLE, KEPT = 1e-4, 10, 4
#: [N.m/A], [kg.m2], [N.m], [N.m.s/rad], [m/rad].
K_T, J, T_C, B, K = 0.291, 4.3e-4, 0.06, 6e-4, 5e-3 / (2.0 * np.pi)
K_P, K_I = 0.1, 2.0


@dataclass(frozen=True)
class Thread:
    """Lead angle [degrees] and friction coefficient."""

    angle: float
    friction: float

    @property
    def shares(self) -> tuple[float, float]:
        """Torque per axial force times travel per angle, raising and lowering."""
        t, mu = np.tan(np.radians(self.angle)), self.friction
        return float((t + mu) / (1.0 - mu * t) / t), float((t - mu) / (1.0 + mu * t) / t)

    @property
    def mu(self) -> float:
        """Friction per load: half the difference of raising and lowering."""
        return 0.5 * (self.shares[0] - self.shares[1])


def reference(kind: str, duration: float = 12.0) -> np.ndarray:
    """[rad/s] Moves of several speeds up and down with rests, or sines."""
    t = np.arange(0.0, duration, STEP * SAMPLE)
    if kind == "moves":
        speeds = np.array([20.0, 60.0, 100.0, 40.0, 80.0, 100.0])[(t // 2).astype(int) % 6]
        ramps = np.interp(t % 2, [0.0, 0.2, 1.6, 1.8, 2.0], [0.0, 1.0, 1.0, 0.0, 0.0])
        return np.asarray(np.sign(np.sin(0.5 * np.pi * t)) * ramps * speeds)
    sines = 60.0 * np.sin(2.0 * np.pi * t / 3.1) + 25.0 * np.sin(2.0 * np.pi * t * 1.1)
    return np.asarray(sines * np.minimum(1.0, t))


def record(thread: Thread, mass: float, kind: str, path: Path, seed: int) -> None:
    """Write a recording of the drive with ``mass`` [kg] at 250 Hz."""
    wanted = reference(kind)
    noise = np.random.default_rng(seed).normal(0.0, [0.15, 0.03], (len(wanted), 2))
    raising, lowering = thread.shares
    load = mass * 9.80665 * K
    speed = integral = 0.0
    rows = []
    for k in range(len(wanted) * SAMPLE):
        error = wanted[k // SAMPLE] - speed
        if k % SAMPLE == 0:
            j = k // SAMPLE
            measured = speed + noise[j, 0], K_P * error + integral + noise[j, 1]
            rows.append((k * STEP, wanted[j], *measured, mass))
        integral += K_I * error * STEP
        torque = K_T * (K_P * error + integral)
        sign = np.sign(speed)
        if speed == 0.0:
            sign = float(torque > load * raising + T_C) - float(torque < load * lowering - T_C)
        if sign == 0.0:
            continue
        share = raising if sign > 0.0 else lowering
        further = speed + STEP * (torque - sign * T_C - B * speed - share * load) / (J + share * mass * K**2)
        speed = 0.0 if speed * further < 0.0 else further  # it comes to rest where the speed turns
    names = ["time_s", "speed_reference_rad_s", "speed_rad_s", "current_A", "mass_kg"]
    pd.DataFrame(rows[::KEPT], columns=names).to_csv(path, index=False)
