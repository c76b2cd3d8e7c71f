"""What became of one job."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.fmu.failure import Status
from thsa_cosim.signals import Signals

__all__ = ["Outcome", "Status"]


@dataclass(frozen=True)
class Outcome:
    """What became of one job. A failed simulation is an outcome, never an exception."""

    status: Status
    reason: str = ""
    """One sentence for a failed run, empty for a good one."""
    signals: Signals | None = None
    reduced: NDArray[np.floating[Any]] | None = None
    """(k,) what the experiment's reducer returned, in single or double precision."""
    duration_s: float = 0.0
    """Wall time of the run in the worker; of a killed run, until it was killed."""
    console: str = ""
    """What native code wrote to stdout and stderr, cut to a few thousand characters."""

    def __reduce__(self) -> tuple[Any, ...]:
        # Every outcome travels: this takes a third of the default's time.
        reduced: Any = self.reduced
        if reduced is not None and reduced.ndim == 1 and reduced.size <= 32:
            reduced = reduced.tolist()
        return _outcome, (
            str(self.status),
            self.reason,
            self.signals,
            reduced,
            self.duration_s,
            self.console,
        )

    @property
    def ok(self) -> bool:
        """Whether the run succeeded."""
        return self.status is Status.OK


def _outcome(
    status: str, reason: str, signals: Signals | None, reduced: Any, duration_s: float, console: str
) -> Outcome:
    if isinstance(reduced, list):
        reduced = np.array(reduced, dtype=np.float64)
    return Outcome(Status(status), reason, signals, reduced, duration_s, console)
