"""How much of a trial a slow FMU is given: each kind of repeated run ends within a given time."""

from dataclasses import dataclass

import numpy as np

SECONDS = 20.0
"""Wall time that each line of repeated runs may take."""
LEAST = 3
"""Runs that are made however long they take."""
SLOW_SHARES = (1 / 8, 1 / 64, 1 / 512)
"""Shares of an experiment that are tried where all of it outlasts the deadline."""
LONGEST_RUN = 2.0
"""Wall time [s] to which runs of an FMU are cut that outlasts the deadline."""


@dataclass(frozen=True)
class Budget:
    """What the runs of an FMU cost: ``run_s``, the wall time [s] of one to the end of ``points`` points."""

    run_s: float = 0.0
    points: int = 2

    def runs(self, wanted: int, points: int | None = None) -> int:
        """How many runs of ``points`` points (default: all) can be made."""
        cost = self.run_s * (points or self.points) / self.points
        return int(np.clip(SECONDS / max(cost, 1e-9), LEAST, max(wanted, LEAST)))

    def points_for(self, runs: int, most: int) -> int:
        """Points of a run that can be made ``runs`` times, at least 2 and at most ``most``."""
        per_point = self.run_s / self.points
        return int(np.clip(SECONDS / runs / max(per_point, 1e-9), 2, max(most, 2)))


def is_slow(duration_s: float, share: float, deadline_s: float) -> bool:
    """Whether a run cut to ``share`` took so long that all of it may outlast the deadline; else it hangs later."""
    return duration_s > 0.3 * share * deadline_s
