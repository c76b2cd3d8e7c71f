"""One batch: what is left to do, and whether an attempt counts.

A run that killed its process is tried once more as the first one of a fresh process: the cause may be what an
earlier run has left there. A machine's fault is tried once more too, then ends the batch with MachineError.
"""

import signal
from collections import deque
from dataclasses import dataclass

from thsa_cosim.batch.job import Job
from thsa_cosim.batch.memory import kills_for_memory
from thsa_cosim.batch.outcome import Outcome, Status
from thsa_cosim.batch.runner import OnOutcome
from thsa_cosim.errors import MachineError

_OUTSIDE = {"SIGKILL", "SIGTERM", "SIGHUP", "SIGINT", "SIGQUIT", "SIGXCPU", "SIGXFSZ", "SIGPWR"}
"""Signals that as a rule somebody else sends; an FMU that sends one to itself does it at the same place twice."""
_AGAIN = "and give the same command again"


@dataclass(frozen=True)
class Attempt:
    """How one attempt at a job ended."""

    outcome: Outcome
    fault: MachineError | None = None
    """Why the machine is to blame; None: it is not."""
    killed_by: str = ""
    """Name of the signal that ended the process, if one did."""
    has_died: bool = False
    """Whether the process ended, by whatever cause of its own."""
    place: tuple[float, ...] = ()
    """Where it was then; see ``Progress.place``."""
    was_first: bool = True
    """Whether it was the first run of its process."""

    @property
    def is_final(self) -> bool:
        """Whether the outcome counts at once."""
        return self.fault is None and not self.has_died and not self.is_inherited

    @property
    def is_inherited(self) -> bool:
        """Whether an earlier run of its process may be to blame: memory used up or spoilt, no second instance."""
        refused = self.outcome.status is Status.LOAD_ERROR and "Instantiate" in self.outcome.reason
        return (refused or self.outcome.status in (Status.MEMORY, Status.CRASH)) and not self.was_first


class Batch:
    """One call of ``run``: what is left to do."""

    def __init__(self, jobs: list[Job], on_outcome: OnOutcome | None) -> None:
        self.jobs = jobs
        self.pending: deque[int] = deque()
        self.retries: deque[int] = deque()
        """Jobs for fresh workers, the first of each."""
        self.refused: dict[int, str] = {}
        """Jobs that got no instance in a process that had one before, and why."""
        self.index: dict[int, int] = {}
        """Serial of an order -> index of its job, for orders in the hands of workers."""
        self.left = len(jobs)
        self._kills = kills_for_memory()
        self._first: dict[int, Attempt] = {}
        self._outcomes: list[Outcome | None] = [None] * len(jobs)
        self._on_outcome = on_outcome

    @property
    def waiting(self) -> int:
        """Number of jobs that no worker has."""
        return len(self.pending) + len(self.retries)

    def ended(self, index: int, attempt: Attempt) -> None:
        """Finish a job, or have it tried again.

        Raises
        ------
        MachineError
            If the machine is to blame for the second time.
        """
        first = self._first.pop(index, None)
        if attempt.is_final:
            self.finish(index, attempt.outcome)
        elif first is None:
            if attempt.outcome.status is Status.LOAD_ERROR and attempt.is_inherited:
                self.refused[index] = attempt.outcome.reason
            self._first[index] = attempt
            self.retries.append(index)
        elif attempt.fault is not None:
            raise attempt.fault
        elif attempt.killed_by in _OUTSIDE:
            self._judge_kill(first, attempt)
            self.finish(index, attempt.outcome)
        else:
            self.finish(index, attempt.outcome)

    def _judge_kill(self, first: Attempt, attempt: Attempt) -> None:
        """MachineError unless the FMU itself has sent the signal both times."""
        if attempt.killed_by == "SIGKILL" and kills_for_memory() > self._kills:
            raise MachineError(
                f"The system ran out of memory and killed a simulation, twice; use fewer workers, or limit what "
                f"one may take (memory, in [simulation]), {_AGAIN}."
            )
        if first.killed_by != attempt.killed_by or first.place != attempt.place:
            raise MachineError(
                f"Simulations were ended from outside by {attempt.killed_by}, twice (by a user, a job scheduler "
                f"or the system when memory is short); see who does that, or use fewer workers, {_AGAIN}."
            )

    def finish(self, index: int, outcome: Outcome) -> None:
        """Take the outcome of a job."""
        assert self._outcomes[index] is None
        self._outcomes[index] = outcome
        self.left -= 1
        if self._on_outcome is not None:
            self._on_outcome(index, outcome)

    def result(self) -> list[Outcome]:
        """Return the outcomes in the order of the jobs."""
        return [outcome for outcome in self._outcomes if outcome is not None]


def fault_of(outcome: Outcome, trouble: MachineError | None) -> MachineError | None:
    """Return the machine's fault behind a failed outcome; ``trouble``: what is wrong with the temporary folder."""
    if outcome.ok or outcome.status is Status.TIMEOUT:
        return None
    if trouble is not None or outcome.status is not Status.MACHINE:
        return trouble
    reason = outcome.reason.rstrip(".")
    if reason == "memory ran out":
        return MachineError(f"The system refused memory to a simulation; use fewer workers, {_AGAIN}.")
    if reason.endswith("same command again"):
        return MachineError(f"{reason}.")
    return MachineError(f"A simulation failed through the machine's fault ({reason}); repair that, {_AGAIN}.")


def signal_name(code: int) -> str:
    """Name the signal of a negative exit code, "" for another."""
    if code >= 0:
        return ""
    try:
        return signal.Signals(-code).name
    except ValueError:
        return f"signal {-code}"
