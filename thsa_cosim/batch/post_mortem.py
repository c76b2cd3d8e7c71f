"""What a worker died of: its exit code, how far it was, and what the runner had against it, as an attempt at a job."""

import time

from thsa_cosim.batch.attempts import Attempt, fault_of, signal_name
from thsa_cosim.batch.outcome import Outcome, Status
from thsa_cosim.batch.process import Progress, WorkerProcess
from thsa_cosim.batch.study import Study
from thsa_cosim.batch.worker import LOST

Cause = tuple[Status, str]
"""Why the runner itself has had to kill a worker, as the begin of a sentence."""
SILENT = (Status.EXIT, "the answer of the worker did not arrive: the FMU spoilt its pipe")
GARBLED = (Status.EXIT, "the FMU wrote into the worker's pipe")
CLOSED = (Status.EXIT, "the FMU closed the worker's pipe")
CHANNEL = (SILENT, GARBLED, CLOSED)
"""Causes that the FMU has done to the worker's pipes."""


def post_mortem(
    worker: WorkerProcess,
    code: int,
    cause: Cause | None,
    console: str,
    *,
    experiment: int,
    study: Study,
    memory_limit: int | None,
) -> Attempt:
    """Say what the job in work died of.

    ``worker`` is reaped, with exit code ``code``; ``cause`` None: it died by itself. ``experiment``: index of the
    job's experiment in ``study``; ``memory_limit``: bytes that one run may take.
    """
    progress = worker.last_progress
    status, reason = cause or _cause_of_death(code, progress, memory_limit)
    lasted = time.monotonic() - (progress.began or worker.since)
    where = progress.where + study.component(experiment, progress.component)
    outcome = Outcome(status, f"{reason} {where}", None, None, lasted, console)
    own = cause is None or cause in CHANNEL
    fault = fault_of(outcome, study.trouble() if own else None)
    # Who kills the supervisor too has been looked for from inside: it is small, and holds no data.
    killed_by = signal_name(code) if cause is None and not worker.lost_supervisor else ""
    return Attempt(outcome, fault, killed_by, own, progress.place, was_first=worker.runs == 0)


def _cause_of_death(code: int, progress: Progress, limit: int | None) -> Cause:
    if limit is not None and progress.growth >= 0.7 * limit:
        return Status.MEMORY, f"the run outgrew {limit / 2**20:.0f} MiB and died"
    if code == LOST:
        return Status.EXIT, "the FMU closed or spoilt the worker's pipes"
    if code >= 0:
        return Status.EXIT, f"the FMU ended the process with exit code {code}"
    return Status.CRASH, f"the process died by {signal_name(code)}"
