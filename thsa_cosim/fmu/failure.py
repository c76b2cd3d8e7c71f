"""What can become of one simulation, as data."""

from enum import StrEnum


class Status(StrEnum):
    """Status of one simulated job."""

    OK = "ok"
    CRASH = "crash"
    """The process died by a signal (segmentation fault, abort) while the FMU's code ran."""
    EXIT = "exit"
    """The FMU ended the process itself (``exit()``)."""
    TIMEOUT = "timeout"
    """The run outlasted its deadline and was killed."""
    FMI_ERROR = "fmi-error"
    FMI_FATAL = "fmi-fatal"
    FMI_DISCARD = "fmi-discard"
    NOT_FINITE = "not-finite"
    """An output became NaN or infinite."""
    INCOMPLETE = "incomplete"
    """The FMU stopped before the last communication point."""
    MEMORY = "memory"
    """The run outgrew its memory limit."""
    LOAD_ERROR = "load-error"
    """The FMU's library or an instance of it cannot be created."""
    BAD_ARCHIVE = "bad-archive"
    """The file is no FMU archive, or one whose entries point outside of it."""
    MACHINE = "machine"
    """The machine's fault (disk, memory): a runner tries again, then raises MachineError; no job ends so."""
    COST_ERROR = "cost-error"
    """The simulation succeeded but reducing it to a cost raised."""


class SimulationFailure(Exception):
    """One run failed; ``status`` says how and ``reason`` is one sentence.

    Raised inside a worker or by ``Plant`` only: a runner turns it into an ``Outcome``.
    """

    def __init__(self, status: Status, reason: str) -> None:
        super().__init__(reason)
        self.status = status
        self.reason = reason

    def __reduce__(self) -> tuple[type["SimulationFailure"], tuple[Status, str]]:
        return type(self), (self.status, self.reason)
