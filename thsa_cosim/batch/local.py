"""Runs batches on this machine: spawned worker processes that an FMU may crash, hang or bloat."""

import itertools
import time
import weakref
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from threadpoolctl import threadpool_limits

from thsa_cosim.batch.attempts import Attempt, Batch, fault_of
from thsa_cosim.batch.frames import Done, Order, Ready, Returned, Setup
from thsa_cosim.batch.inbox import Inbox, open_inbox
from thsa_cosim.batch.job import Experiment, Job
from thsa_cosim.batch.outcome import Outcome, Status
from thsa_cosim.batch.post_mortem import CHANNEL, CLOSED, GARBLED, SILENT, Cause, post_mortem
from thsa_cosim.batch.process import WorkerProcess
from thsa_cosim.batch.runner import OnOutcome, TimeIsOver, check_jobs, wrapper_names
from thsa_cosim.batch.study import Study
from thsa_cosim.closing import Closing
from thsa_cosim.errors import ParameterError, StudyError
from thsa_cosim.fmu.machine import temporary_fault
from thsa_cosim.fmu.plant import Backend, Kind, Reuse, Stepping

_TICK_S = 0.05
"""How often deadlines, memory and floods are looked at."""
_START_LIMIT_S = 180.0
"""A worker that is not ready by then is taken for dead (first start: machine code is compiled)."""
_REFUSALS = 2  # instances that only a fresh process gave: the FMU gives one per process
_FAILED_STARTS = 3
_CLOSE_S = 2.0
_AHEAD_S = 0.02
_SILENT_TICKS = 60
_AHEAD = 32
"""A worker has at hand what keeps it busy for _AHEAD_S, at most _AHEAD orders."""


class LocalRunner(Closing):
    """Worker processes with one live FMU instance each; see ``Runner``.

    A run that crashes, exits, hangs, outgrows its memory or floods its output costs its worker at most: the
    job gets an Outcome that says so, and jobs that were waiting in that worker go to others. A run that killed
    its worker is repeated once, first in a fresh one, before that counts. So is one that failed through the
    machine's fault (disk, memory, a signal from outside), which has no outcome but ends the batch.
    """

    def __init__(
        self,
        experiments: Sequence[Experiment],
        *,
        workers: int = 1,
        deadline_s: float | None = None,
        ends_at: float | None = None,
        memory_limit_mb: float | None = None,
        reuse: Reuse = "fresh",
        stepping: Stepping = "free",
        kind: Kind | None = None,
        backend: Backend | None = None,
        recycle_runs: int = 10_000,
        recycle_growth_mb: float = 512.0,
        console_limit: int = 8192,
    ) -> None:
        """Unpack the FMUs, write down the experiments, start the workers.

        Parameters
        ----------
        workers
            Number of processes.
        deadline_s
            Wall time after which a run is killed (to 0.05 s), s; None: never.
        ends_at
            Time (of ``time.monotonic``) after which no further job is begun: ``run`` raises TimeIsOver.
        memory_limit_mb
            MiB that one worker may grow beyond its idle size; None: no limit.
        reuse
            "fresh": a new instance per run. "reset": only for FMUs whose reset is known to be right.
        kind, backend, stepping
            As for ``Plant.open``.
        recycle_runs, recycle_growth_mb
            A worker is replaced after so many runs, or when idle it has grown by so many MiB (leaks).
        console_limit
            Bytes of native output kept per run.

        Raises
        ------
        ParameterError, FmuError
            If an experiment names variables that its FMU does not have. An FMU that cannot be read is an
            outcome (``Status.BAD_ARCHIVE``) of its jobs instead.
        MachineError
            If the temporary folder cannot be used.
        """
        if workers < 1:
            raise ParameterError(f"workers is {workers}; it must be at least 1.")
        self.notes: Sequence[str] = ()
        self.one_run_per_process = (
            ""  # why each run has a process of its own: what the FMU says of a second instance
        )
        self._doubts_refusals, self._refusals = True, 0
        self._study = Study(experiments)
        self._wrapped = wrapper_names(experiments)
        self._count = workers
        self._deadline = deadline_s
        self._ends_at = ends_at
        self._memory_limit = None if memory_limit_mb is None else int(memory_limit_mb * 2**20)
        self._recycle_runs = recycle_runs
        self._recycle_growth = int(recycle_growth_mb * 2**20)
        self._setup = Setup(
            root=str(self._study.folder),
            folder="",
            memory_limit=self._memory_limit,
            console_limit=console_limit,
            kind=kind,
            backend=backend,
            reuse=reuse,
            stepping=stepping,
            main=self._study.main,
        )
        self._inbox = open_inbox()
        self._workers: list[WorkerProcess] = []
        self._serials = itertools.count(1)
        self._numbers = itertools.count(1)
        self._failed_starts = 0
        self._next_tick = 0.0
        self._typical_s = 1.0
        # The cores are the workers': a search's small products in BLAS threads cost ten times their own time.
        blas = threadpool_limits(limits=1, user_api="blas")
        # Also at interpreter exit and when the runner is forgotten; must not refer to self.
        self._finalizer = weakref.finalize(self, _shut_down, self._workers, self._inbox, self._study, blas)
        self._staff(workers)

    # -- public ---------------------------------------------------------------------------------------
    def run(self, jobs: Sequence[Job], on_outcome: OnOutcome | None = None) -> list[Outcome]:
        """Run all jobs; see ``Runner.run``.

        StudyError if workers cannot be started at all, MachineError if the machine is to blame for a run that
        failed twice: nothing is known of it. KeyboardInterrupt, or whatever ``on_outcome``
        raises, ends the batch: busy workers are killed, and the runner can be used again.
        """
        if not self._finalizer.alive:
            raise StudyError("The runner is closed; open a new one.")
        jobs = list(jobs)
        self._end_in_time(())
        check_jobs(jobs, self._study.descriptions, self._wrapped)
        batch = Batch(jobs, on_outcome)
        try:
            for index, job in enumerate(jobs):
                failure = self._study.failures.get(job.experiment)
                if failure is None:
                    batch.pending.append(index)
                else:
                    batch.finish(index, failure)
            while batch.left:
                self._staff(min(self._count, batch.waiting + len(batch.index)), len(batch.retries))
                self._feed(batch)
                left = batch.left
                self._wait(batch)
                if 0 < batch.left < left:
                    self._end_in_time(batch.result())
        except BaseException:
            for worker in [w for w in self._workers if w.assigned]:
                self._dismiss(worker)
            raise
        return batch.result()

    def _end_in_time(self, outcomes: Sequence[Outcome]) -> None:
        if self._ends_at is not None and time.monotonic() > self._ends_at:
            raise TimeIsOver(outcomes)

    def close(self) -> None:
        """Stop the workers and remove all folders; safe to call twice."""
        self._finalizer()

    # -- staff ----------------------------------------------------------------------------------------
    def _staff(self, wanted: int, fresh: int = 0) -> None:
        """Start workers until ``wanted`` are there, as far as possible ``fresh`` ones among them."""
        missing = fresh - sum(w.is_fresh for w in self._workers)
        for worker in [w for w in self._workers if not (w.is_fresh or w.assigned or w.is_leaving)]:
            if missing > 0:
                worker.is_leaving = True
                worker.ask_to_stop()
                missing -= 1
        present = sum(not w.is_leaving for w in self._workers)
        for _ in range(present, wanted):
            folder = self._study.folder / "workers" / str(next(self._numbers))
            try:
                self._workers.append(WorkerProcess(self._setup, folder, self._inbox))
            except OSError as error:
                raise self._study.trouble() or temporary_fault(error, self._study.folder.parent) from None

    def _dismiss(self, worker: WorkerProcess) -> int:
        """Kill and forget a worker; return its exit code."""
        if worker in self._workers:
            self._workers.remove(worker)
        return worker.reap()

    def _feed(self, batch: Batch) -> None:
        """Give every worker a job, then some at hand, so that it never waits for the next one.

        The shorter the runs, the more orders go into one message. Near the end of a batch nobody hoards.
        """
        ahead = min(_AHEAD, 1 + int(_AHEAD_S / self._typical_s))
        # Nothing is sent to a worker that is being recalled: its listener may be waiting to answer.
        staff = [w for w in self._workers if w.is_ready and not w.is_leaving and not w.is_recalled]
        for worker in staff:
            if worker.is_fresh and batch.retries:
                batch.pending.appendleft(batch.retries.popleft())
                self._give(worker, 1, batch)
        for worker in staff:
            if not worker.assigned and batch.pending:
                self._give(worker, 1, batch)
        for worker in staff:
            if len(worker.assigned) <= (ahead + 1) // 2:
                fair = len(batch.pending) // len(staff)
                self._give(worker, min(1 + ahead - len(worker.assigned), fair), batch)

    def _give(self, worker: WorkerProcess, count: int, batch: Batch) -> None:
        orders = []
        for _ in range(min(count, self._recycle_runs - worker.runs - len(worker.assigned))):
            index = batch.pending.popleft()
            job = batch.jobs[index]
            serial = next(self._serials)
            batch.index[serial] = index
            orders.append(
                Order(serial, self._study.index[job.experiment], dict(job.values), job.keep_signals)
            )
        if orders:
            worker.give(orders)

    def _recall(self, batch: Batch) -> None:
        """When somebody idles, take back what waits behind a run that takes long (it may hang)."""
        if batch.pending or not any(
            w.is_ready and not w.is_leaving and not w.assigned for w in self._workers
        ):
            return
        late = time.monotonic() - _TICK_S
        for worker in self._workers:
            if (
                worker.is_ready
                and len(worker.assigned) > 1
                and worker.since < late
                and not worker.is_recalled
            ):
                worker.recall()

    # -- events ---------------------------------------------------------------------------------------
    def _wait(self, batch: Batch) -> None:
        """Handle one event, or a tick of the clock."""
        event = self._inbox.get(_TICK_S)
        if event is not None and event[0] in self._workers:
            self._handle(*event, batch)
        if time.monotonic() >= self._next_tick:
            self._next_tick = time.monotonic() + _TICK_S
            self._inspect(batch)

    def _handle(self, worker: WorkerProcess, message: Any, at: float, batch: Batch) -> None:
        match message:
            case Ready(rss=rss, pid=pid):
                worker.is_ready, worker.idle_rss, worker.since, worker.worker_pid = True, rss, at, pid
                self._failed_starts = 0
            case Done() as done if worker.assigned and worker.assigned[0].serial == done.serial:
                self._finished(worker, done, at, batch)
            case Returned(serials=serials):
                self._returned(worker, serials, batch)
            case None:
                self._died(worker, batch, None if worker.ends_within(1.0) else CLOSED)
            case _:
                self._died(worker, batch, GARBLED)

    def _finished(self, worker: WorkerProcess, done: Done, at: float, batch: Batch) -> None:
        worker.assigned.popleft()
        worker.since, worker.silent_ticks = at, 0
        worker.runs += 1
        worker.is_leaving |= done.leaves
        outcome = done.outcome
        if (console := worker.whole_console(done.serial, outcome.console)) != outcome.console:
            outcome = replace(outcome, console=console)
        self._typical_s = max(0.8 * self._typical_s + 0.2 * outcome.duration_s, 1e-6)
        trouble = None if outcome.ok else self._study.trouble()
        fault = fault_of(outcome, trouble)
        if (index := batch.index.pop(done.serial)) in batch.refused:
            self._judge_refusal(outcome.ok, batch.refused[index])
        sure = outcome.status is Status.LOAD_ERROR and not self._doubts_refusals
        attempt = Attempt(outcome, fault, was_first=worker.runs == 1 or sure)
        tired = worker.runs >= self._recycle_runs or done.rss - worker.idle_rss >= self._recycle_growth
        if tired and not worker.is_leaving:
            worker.is_leaving = True
            worker.ask_to_stop()  # comes after the orders that it still has
        batch.ended(index, attempt)

    def _judge_refusal(self, helped: bool, reason: str) -> None:
        """An FMU that refused an instance and gives one to a fresh process: every run gets one."""
        self._doubts_refusals, self._refusals = helped, self._refusals + helped
        if self._refusals >= _REFUSALS:
            self.one_run_per_process, self._recycle_runs = reason, 1

    @staticmethod
    def _returned(worker: WorkerProcess, serials: tuple[int, ...], batch: Batch) -> None:
        worker.is_recalled = False
        back = [order for order in worker.assigned if order.serial in serials]
        for order in reversed(back):
            worker.assigned.remove(order)
            batch.pending.appendleft(batch.index.pop(order.serial))

    def _inspect(self, batch: Batch) -> None:
        """Kill workers that are late, too large, or do not start."""
        self._recall(batch)
        now = time.monotonic()
        for worker in list(self._workers):
            growth = worker.watch()
            if worker.has_died():
                # As a rule its pipe has told so before, but a child of the FMU may hold that open.
                self._died(worker, batch, None)
            elif not worker.is_ready:
                if now - worker.since > _START_LIMIT_S:
                    self._died(worker, batch, None)
            elif worker.assigned:
                self._check_limits(worker, growth, batch)

    def _check_limits(self, worker: WorkerProcess, growth: int, batch: Batch) -> None:
        progress, now = worker.progress(), time.monotonic()
        if progress.serial != worker.assigned[0].serial:
            # Between two jobs: what it has finished is on its way, or an FMU has spoilt it.
            worker.silent_ticks += 1
            if worker.silent_ticks > _SILENT_TICKS:
                self._died(worker, batch, SILENT)
            return
        worker.silent_ticks = 0
        if progress.began is None:
            if now - worker.since > _START_LIMIT_S:
                reason = f"the experiment was not read within {_START_LIMIT_S:g} s"
                self._died(worker, batch, (Status.LOAD_ERROR, reason))
        elif self._deadline is not None and now - progress.began > self._deadline:
            reason = f"the run was killed after {self._deadline:g} s"
            self._died(worker, batch, (Status.TIMEOUT, reason))
        elif self._memory_limit is not None and growth > 1.1 * self._memory_limit:
            reason = f"the run outgrew {self._memory_limit / 2**20:.0f} MiB and was killed"
            self._died(worker, batch, (Status.MEMORY, reason))

    def _died(self, worker: WorkerProcess, batch: Batch, cause: Cause | None) -> None:
        """Reap a worker; blame the job in work, if any, and put the others back to the front.

        ``cause`` says why the runner itself has had to kill it.
        """
        accused = worker.assigned[0].serial if worker.assigned else 0
        console = worker.console()
        code = self._dismiss(worker)
        for _, message, at in worker.last_words:
            first = worker.assigned[0].serial if worker.assigned else None
            if isinstance(message, Done) and message.serial == first:
                self._finished(worker, message, at, batch)
        progress = worker.last_progress
        orders = list(worker.assigned)
        worker.assigned.clear()
        if not worker.is_ready:
            self._failed_starts += 1
            if (trouble := self._study.trouble()) is not None:
                raise trouble
            if self._failed_starts >= _FAILED_STARTS:
                tail = " ".join(console.split())[-300:]
                raise StudyError(f"Worker processes do not start (exit code {code}): {tail or 'no message'}.")
        # A job that began while the runner was killing its predecessor is innocent, and runs again.
        begun = bool(orders) and progress.serial == orders[0].serial
        if orders and (cause in CHANNEL or (begun and (cause is None or orders[0].serial == accused))):
            order = orders.pop(0)
            attempt = post_mortem(
                worker,
                code,
                cause,
                console,
                experiment=order.experiment,
                study=self._study,
                memory_limit=self._memory_limit,
            )
            batch.ended(batch.index.pop(order.serial), attempt)
        for order in reversed(orders):
            batch.pending.appendleft(batch.index.pop(order.serial))


def _shut_down(workers: list[WorkerProcess], inbox: Inbox, study: Study, blas: threadpool_limits) -> None:
    """Stop all workers, idle ones politely, remove the study's folder, and give BLAS its threads back."""
    blas.restore_original_limits()
    for worker in workers:
        if not worker.assigned:
            worker.ask_to_stop()
    until = time.monotonic() + _CLOSE_S
    for worker in workers:
        worker.join(0.0 if worker.assigned or not worker.is_ready else until - time.monotonic())
    workers.clear()
    inbox.close()
    study.remove()
