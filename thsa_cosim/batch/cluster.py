"""The same jobs on a Dask cluster (extra ``cluster``).

Each Dask task runs one job in a LocalRunner of its own worker, so an FMU that crashes or hangs costs a
process there, not the Dask worker. The study (experiments and FMU archives) goes to every Dask worker once,
named by its digest; a worker that joins later gets it from another one. A lost worker's jobs are run again
elsewhere, by Dask; each job has exactly one outcome.
"""

import contextlib
import hashlib
import importlib
import io
import pickle
import threading
import uuid
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from thsa_cosim.batch.job import Experiment, Job
from thsa_cosim.batch.local import LocalRunner
from thsa_cosim.batch.outcome import Outcome, Status
from thsa_cosim.batch.runner import OnOutcome, check_experiment, check_jobs, wrapper_names
from thsa_cosim.closing import Closing
from thsa_cosim.errors import FmuError, InputError, MachineError, MissingExtraError
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.scratch import ScratchFolder
from thsa_cosim.system import read_description

_CONNECT_S = 20.0
_ATTEMPTS = 3
"""How often the study is sent anew because all workers that held it were lost."""


@dataclass(frozen=True)
class Parcel:
    """A study as it travels."""

    digest: str
    experiments: tuple[Experiment, ...]
    archives: dict[str, bytes]
    """File name, as in the experiments' ``fmu``, -> content of the archive."""
    options: dict[str, Any]
    """Keyword arguments of LocalRunner."""


class ClusterRunner(Closing):
    """Runs batches on the Dask cluster at ``address``; see ``Runner``."""

    def __init__(
        self,
        experiments: Sequence[Experiment],
        address: str,
        *,
        timeout_s: float = _CONNECT_S,
        **options: Any,
    ) -> None:
        """Connect to the scheduler and send the study to all of its workers.

        Parameters
        ----------
        address
            Of the scheduler, e.g. "tcp://host:8786".
        timeout_s
            How long to wait for the scheduler, s.
        options
            As for LocalRunner (``deadline_s``, ``memory_limit_mb``, ...), but ``workers``: every thread of
            every Dask worker runs one job at a time.

        Raises
        ------
        MissingExtraError
            If dask.distributed is not installed.
        InputError
            If the scheduler does not answer or has no workers.
        """
        try:
            distributed: Any = importlib.import_module("distributed")
        except ImportError:
            raise MissingExtraError("Running on a cluster", "cluster") from None
        self.notes: Sequence[str] = ()
        self._distributed = distributed
        self._descriptions, self._failures = _describe(experiments)
        self._wrapped = wrapper_names(experiments)
        self._parcel = _pack(experiments, options)
        try:
            # A client of a malformed address would be torn down with a traceback, half a minute later.
            importlib.import_module("distributed.comm").get_address_host_port(address)
        except ValueError:
            raise InputError(
                f"{address!r} is no address of a Dask scheduler; give its host and port, such as tcp://host:8786."
            ) from None
        try:
            self._client = distributed.Client(address, timeout=timeout_s, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            reason = " ".join(str(error).split()).rstrip(".")
            raise InputError(
                f"No Dask scheduler answers at {address} ({reason}); start it with 'dask scheduler', or correct the"
                " address."
            ) from None
        try:
            if not self._client.scheduler_info()["workers"]:
                self._client.wait_for_workers(1, timeout=timeout_s)
            self._send()
        except TimeoutError:
            self._client.close()
            raise InputError(
                f"The Dask scheduler at {address} has no workers; start some with 'dask worker {address}'."
            ) from None
        except BaseException:
            self._client.close()
            raise

    def _send(self) -> None:
        # hash=False: a future of its own name, so that nothing else's loss can touch it.
        self._shipped = self._client.scatter(self._parcel, broadcast=True, hash=False)

    def run(self, jobs: Sequence[Job], on_outcome: OnOutcome | None = None) -> list[Outcome]:
        """Run all jobs; see ``Runner.run``."""
        jobs = list(jobs)
        check_jobs(jobs, self._descriptions, self._wrapped)
        outcomes: list[Outcome | None] = [None] * len(jobs)

        def finish(index: int, outcome: Outcome) -> None:
            outcomes[index] = outcome
            if on_outcome is not None:
                on_outcome(index, outcome)

        waiting = []
        for index, job in enumerate(jobs):
            failure = self._failures.get(job.experiment)
            if failure is None:
                waiting.append(index)
            else:
                finish(index, failure)
        for attempt in range(_ATTEMPTS):
            if attempt:
                self._client.wait_for_workers(1, timeout=_CONNECT_S)
                self._send()
            waiting = self._round(jobs, waiting, finish)
            if not waiting:
                break
        if waiting:
            raise MachineError(
                f"The cluster lost its workers {_ATTEMPTS} times; look after them (memory, job limits) and give the "
                f"same command again."
            )
        return [outcome for outcome in outcomes if outcome is not None]

    def _round(self, jobs: Sequence[Job], indexes: Sequence[int], finish: Any) -> list[int]:
        """Submit jobs and collect outcomes; return the jobs whose study got lost with its workers."""
        run = uuid.uuid4().hex
        futures = [
            self._client.submit(run_job, self._shipped, jobs[i], key=f"thsa-{run}-{i}", pure=False)
            for i in indexes
        ]
        index_of = {future.key: i for future, i in zip(futures, indexes, strict=True)}
        lost = []
        try:
            done = self._distributed.as_completed(
                futures, loop=self._client.loop, with_results=True, raise_errors=False
            )
            for future, result in done:
                index = index_of[future.key]
                if future.status == "finished":
                    finish(index, result)
                elif future.status in ("cancelled", "lost"):
                    lost.append(index)
                else:
                    finish(index, _task_failure(result))
        except BaseException:
            with contextlib.suppress(Exception):
                self._client.cancel(futures, force=True)
            raise
        return sorted(lost)

    def close(self) -> None:
        """Have the workers drop the study, and disconnect."""
        with contextlib.suppress(Exception):
            self._client.run(close_study, self._parcel.digest, on_error="ignore")
        with contextlib.suppress(Exception):
            self._client.close()


def _describe(
    experiments: Sequence[Experiment],
) -> tuple[dict[str, FmuDescription | None], dict[str, Outcome]]:
    descriptions: dict[str, FmuDescription | None] = {}
    failures: dict[str, Outcome] = {}
    read: dict[Path, FmuDescription] = {}
    for experiment in experiments:
        try:
            if experiment.fmu not in read:
                read[experiment.fmu] = read_description(experiment.fmu)
        except FmuError as error:
            descriptions[experiment.name] = None
            failures[experiment.name] = Outcome(Status.BAD_ARCHIVE, str(error).rstrip("."))
            continue
        check_experiment(experiment, read[experiment.fmu])
        descriptions[experiment.name] = read[experiment.fmu]
    return descriptions, failures


def _pack(experiments: Sequence[Experiment], options: dict[str, Any]) -> Parcel:
    archives: dict[str, bytes] = {}
    travelling = []
    for experiment in experiments:
        path = Path(experiment.fmu)
        name = path.name
        if path.is_file():
            content = path.read_bytes()
            name = f"{hashlib.sha256(content).hexdigest()[:16]}-{path.name}"
            archives[name] = content
        travelling.append(replace(experiment, fmu=Path(name)))
    digest = hashlib.sha256(_content((travelling, sorted(archives), options)))
    return Parcel(digest.hexdigest(), tuple(travelling), archives, options)


def _content(value: object) -> bytes:
    """Pickle by content alone: without memo, equal strings that are not the same object make no difference."""
    stream = io.BytesIO()
    pickler = pickle.Pickler(stream)
    pickler.fast = True
    pickler.dump(value)
    return stream.getvalue()


def _task_failure(result: Any) -> Outcome:
    """Outcome of a task that raised; MachineError if workers died under it, or the machine is to blame."""
    error = result[1] if isinstance(result, tuple) else result
    text = " ".join(f"{type(error).__name__}: {error}".split())[:500]
    if isinstance(error, MachineError):
        raise error
    if type(error).__name__ == "KilledWorker":  # FMUs run in processes of their own: it is not their doing
        raise MachineError(
            "The cluster lost every worker that tried one of the simulations; look after them (memory, job limits) "
            "and give the same command again."
        )
    return Outcome(Status.LOAD_ERROR, f"the cluster's worker raised {text}")


# -- on the Dask workers ----------------------------------------------------------------------------------
class _Unpacked:
    """A study on a Dask worker: one LocalRunner with one process per concurrent task."""

    def __init__(self, parcel: Parcel) -> None:
        self._parcel = parcel
        self._folder = ScratchFolder()
        folder = self._folder.path
        for name, content in parcel.archives.items():
            (folder / name).write_bytes(content)
        self._experiments = [replace(e, fmu=folder / e.fmu) for e in parcel.experiments]
        self._idle: list[LocalRunner] = []
        self._lock = threading.Lock()
        self._closed = False

    def run(self, job: Job) -> Outcome:
        with self._lock:
            runner = self._idle.pop() if self._idle else None
        if runner is None:
            runner = LocalRunner(self._experiments, workers=1, **self._parcel.options)
        try:
            (outcome,) = runner.run([job])
        except BaseException:
            runner.close()
            raise
        with self._lock:
            if not self._closed:
                self._idle.append(runner)
                return outcome
        runner.close()
        return outcome

    def close(self) -> None:
        with self._lock:
            self._closed = True
            idle, self._idle = self._idle, []
        for runner in idle:
            runner.close()
        self._folder.remove()


_studies: dict[str, _Unpacked] = {}
_studies_lock = threading.Lock()


def run_job(parcel: Parcel, job: Job) -> Outcome:
    """Run one job; executed in a thread of a Dask worker."""
    with _studies_lock:
        if parcel.digest not in _studies:
            _studies[parcel.digest] = _Unpacked(parcel)
        study = _studies[parcel.digest]
    return study.run(job)


def close_study(digest: str) -> None:
    """Drop a study; executed on every Dask worker."""
    with _studies_lock:
        study = _studies.pop(digest, None)
    if study is not None:
        study.close()
