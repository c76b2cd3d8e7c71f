"""Inputs of the experiments: the ramp of table IV and the schedules of the driven recordings.

Row k of a driven or table IV recording holds the schedule, and the rig's response, at (k + 1) ms.
"""

from __future__ import annotations

import numpy as np

from reference.waves import Wave, constant, wave

RAMP = wave((0.0, 0.0), (0.3, 9e-3))
RAMP_LOAD = constant(55e3)
LOAD_SLEW = 2e5  # N/s


def ramped(rate: float, start: float, *moves: tuple[float, float]) -> Wave:
    """Begin at `start`; at each (time, level) move to the level at `rate` per second."""
    points, level = [(0.0, start)], start
    for time, target in moves:
        points += [(time, level), (time + abs(target - level) / rate, target)]
        level = target
    return wave(*points)


DRIVEN_A = ramped(
    30e-3,
    0.0,
    (0.5, 9e-3),
    (2.0, 3e-3),
    (3.5, -9e-3),
    (5.0, -3e-3),
    (6.5, 0.0),
    (7.1, 9e-3),
    (8.6, 5e-3),
    (9.8, -9e-3),
    (11.3, -5e-3),
    (12.5, 0.0),
    (13.1, 9e-3),
    (14.6, 2e-3),
    (15.8, -9e-3),
    (17.3, -2e-3),
    (18.5, 1e-3),
    (19.5, -1e-3),
)
DRIVEN_A_LOAD = ramped(LOAD_SLEW, 0.0, (6.5, 25e3), (12.5, 55e3), (19.5, 10e3))
DRIVEN_A_END = 20.5

DRIVEN_B = ramped(
    30e-3,
    0.0,
    (0.4, 7e-3),
    (1.6, -7e-3),
    (3.0, 0.0),
    (3.5, 4e-3),
    (4.9, 8e-3),
    (6.3, -8e-3),
    (7.7, -4e-3),
    (9.1, 0.0),
    (9.6, 6e-3),
    (11.0, -6e-3),
    (12.4, 1.5e-3),
    (13.4, -1.5e-3),
    (14.4, 9e-3),
    (15.6, -9e-3),
)
DRIVEN_B_LOAD = ramped(LOAD_SLEW, 10e3, (3.0, 40e3), (9.1, -30e3), (13.4, 0.0))
DRIVEN_B_END = 16.8


def samples(end: float, step: float = 1e-3) -> np.ndarray:
    """0, step, ... up to and without `end`, (n,) s."""
    return np.arange(round(end / step)) * step
