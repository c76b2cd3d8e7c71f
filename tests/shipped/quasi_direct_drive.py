"""A quasi-direct drive on a bench, to which parts are added: recordings that share nothing with its Modelica model.

The drive samples its encoder at 1 kHz, filters the speed and commands a current; the gear sticks by force balance,
loses a share of the torque and has a small ripple. Explicit Euler at 50 us: the electrical lag is ten steps.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

#: [kg.m2], [N.m], [N.m.s/rad], [N.m/rad], share of the torque.
BARE = {"J": 4.1e-3, "T_c": 0.14, "b": 0.012, "c": 0.0, "mu": 0.03}
#: What each part adds.
PARTS: Mapping[str, Mapping[str, float]] = {
    "bare": {},
    "disc": {"J": 1e-3},
    "spring": {"c": 0.4},
    "bearing": {"T_c": 0.03, "b": 0.004},
}
STEP, SAMPLE, KEPT = 5e-5, 20, 4
COUNT = 2.0 * np.pi / 16384
K_T, K_P, K_D = 0.585, 60.0, 0.8


def reference(time: np.ndarray) -> np.ndarray:
    """[rad] A chirp that begins softly."""
    return np.asarray(0.8 * np.sin(2 * np.pi * (0.3 * time + 0.06 * time**2)) * np.minimum(1.0, time))


def record(part: str, path: Path, seed: int, duration: float = 16.0) -> None:
    """Write a recording of the drive with ``part`` at 250 Hz."""
    p = {name: value + PARTS[part].get(name, 0.0) for name, value in BARE.items()}
    noise = np.random.default_rng(seed).normal(0.0, 0.03, round(duration / STEP / SAMPLE))
    wanted = reference(np.arange(len(noise)) * STEP * SAMPLE)
    angle = speed = current = command = filtered = last = 0.0
    rows = []
    for k in range(len(noise) * SAMPLE):
        if k % SAMPLE == 0:
            j = k // SAMPLE
            seen = round(angle / COUNT) * COUNT
            filtered += 0.45 * ((seen - last) / (SAMPLE * STEP) - filtered)
            last = seen
            command = (K_P * (wanted[j] - seen) - K_D * filtered) / 0.6
            rows.append((j * SAMPLE * STEP, wanted[j], seen, filtered, current + noise[j]))
        current += STEP / 5e-4 * (command - current)
        torque = K_T * current - p["c"] * angle + 0.012 * np.sin(72.0 * angle + 0.3)
        friction = p["T_c"] + p["mu"] * abs(K_T * current)
        if speed == 0.0 and abs(torque) <= friction:
            continue
        acceleration = (torque - np.sign(speed or torque) * friction - p["b"] * speed) / p["J"]
        further = speed + acceleration * STEP
        speed = 0.0 if speed * further < 0.0 else further  # it comes to rest where the speed turns
        angle += speed * STEP
    names = ["time_s", "reference_rad", "angle_rad", "speed_rad_s", "current_A"]
    pd.DataFrame(rows[::KEPT], columns=names).to_csv(path, index=False)
