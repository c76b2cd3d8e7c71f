"""Inputs as waves: (times, values), linear between the times and constant outside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reference.rig import FloatArray


@dataclass(frozen=True)
class Wave:
    """Piecewise-linear signal; with `hold` each value lasts until the next one."""

    times: FloatArray  # (n,) s, increasing
    values: FloatArray  # (n,)
    hold: bool = False

    def __call__(self, time: float) -> float:
        if self.hold:
            return float(self.values[max(0, int(np.searchsorted(self.times, time, side="right")) - 1)])
        return float(np.interp(time, self.times, self.values))

    def at(self, time: FloatArray) -> FloatArray:
        return np.array([self(t) for t in time.tolist()])

    def kinks(self) -> FloatArray:
        """Times at which the value jumps (hold) or the slope changes."""
        if self.hold:
            return self.times[1:][np.diff(self.values) != 0.0]
        slope = np.diff(self.values) / np.diff(self.times)
        turns = np.abs(np.diff(slope)) > 1e-9 * float(np.abs(slope).max(initial=1e-300))
        return np.concatenate([self.times[:1], self.times[1:-1][turns], self.times[-1:]])


def wave(*points: tuple[float, float]) -> Wave:
    """A wave through (time, value) points."""
    times, values = zip(*points, strict=True)
    return Wave(np.array(times, dtype=float), np.array(values, dtype=float))


def constant(value: float) -> Wave:
    return Wave(np.array([0.0, 1.0]), np.array([value, value]))


def pieces(time: FloatArray, *waves: Wave) -> FloatArray:
    """Edges of the pieces of [time[0], time[-1]] within which every wave is smooth."""
    kinks = np.concatenate([wave.kinks() for wave in waves])
    return np.unique(np.concatenate([time[[0, -1]], kinks[(kinks > time[0]) & (kinks < time[-1])]]))
