"""How much of a trial a slow FMU is given: each kind of repeated run ends within a given time."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

SECONDS = 20.0
"""Wall time that each line of repeated runs may take."""
TOTAL = 300.0
"""Wall time [s] after which a check begins no further run."""
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


@dataclass(frozen=True)
class Watch:
    """How long a check may take: ``limit_s`` [s] of wall time since the watch was made."""

    limit_s: float = TOTAL
    start: float = field(default_factory=time.monotonic)

    @property
    def ends_at(self) -> float:
        """The time, of ``time.monotonic``, after which nothing more is begun."""
        return self.start + self.limit_s

    @property
    def is_over(self) -> bool:
        """Whether nothing more is begun."""
        return time.monotonic() > self.ends_at

    def while_affordable(self, count: int) -> Iterator[int]:
        """Yield 0, 1, ... ``count`` - 1; at least ``LEAST``, then as long as a line of repeated runs may take.

        Runs that hang last until the deadline, whatever the first one took.
        """
        begin = time.monotonic()
        for k in range(count):
            if k >= LEAST and (time.monotonic() - begin > 2.0 * SECONDS or self.is_over):
                return
            yield k
