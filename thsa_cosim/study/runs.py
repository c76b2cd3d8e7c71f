"""The log of a study's runs: what was simulated once is not simulated again, whatever ended the study.

The file holds one record per run: a frame (length and checksum), the run's key, what became of it. A key is a digest
of all that decides the outcome: the FMU's archive, inputs, times, start values, solver settings, and what the worker
makes of the signals. A kill tears the last record at most, which is dropped when the log is opened again.

Outcomes are kept up to ``LARGEST`` bytes and as far as the disk has room (``SHARE``): to write the residuals of a run
takes a hundredth of simulating it. A diagnosis of a few long recordings comes to 0.2 to 0.8 GB, one that searches for
an empirical law to more (residuals of 0.4 MB a run); it goes when the study is complete. The first
runs are those that are kept: a continued study asks for them first. Timing apart, a recalled outcome is bit for bit the
one that was returned.
"""

import contextlib
import hashlib
import json
import os
import pickle
import shutil
import struct
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from thsa_cosim.batch import Experiment, Job, Outcome, Runner, Status
from thsa_cosim.batch.runner import OnOutcome
from thsa_cosim.closing import Closing
from thsa_cosim.errors import InputError, MachineError
from thsa_cosim.signals import Signals

RUNS = "runs.log"
#: So many bytes may be kept at most, and this share of what the disk has left when the study is opened.
LARGEST, SHARE = 2_000_000_000, 0.25
#: Outcomes up to this size (cost terms, say) are always kept.
SMALL = 2_000
_MAGIC = b"thsa-cosim runs 1\n"
_FRAME = struct.Struct("<II")
_KEY = 16


class RunLog(Closing):
    """Outcomes by key, in a file that only grows; a context manager."""

    def __init__(self, path: Path, file: BinaryIO, say: Callable[[str], None] = lambda _: None) -> None:
        """``RunLog.open`` is the way in."""
        self.path = path
        self._say = say
        self.recalled = 0
        """Outcomes that were looked up."""
        self.left_out = 0
        """Large outcomes for which there was no room."""
        self._file = file
        self._at: dict[bytes, tuple[int, int]] = {}
        self._end = 0
        self._allowed = LARGEST

    @classmethod
    def open(cls, path: Path, say: Callable[[str], None] = lambda _: None) -> "RunLog":
        """Open or create the log; InputError if another run uses it, or it is no log.

        ``say`` is told once that it is full.
        """
        file = path.open("a+b", buffering=0)
        try:
            _lock(path, file)
            log = cls(path, file, say)
            log._load()
            log._allowed = min(LARGEST, log._end + int(SHARE * shutil.disk_usage(path.parent).free))
        except BaseException:
            file.close()
            raise
        return log

    def __len__(self) -> int:
        return len(self._at)

    def known(self, key: bytes) -> Outcome | None:
        """Return the outcome of exactly this run, or None."""
        found = self._at.get(key)
        if found is None:
            return None
        self.recalled += 1
        return _decoded(os.pread(self._file.fileno(), found[1], found[0]))

    def append(self, key: bytes, outcome: Outcome) -> None:
        """Keep an outcome; a large one as far as there is room, for it can be simulated again.

        MachineError if it cannot be written; the log is then as it was before. A machine's fault is no outcome.
        """
        if outcome.status is Status.MACHINE:
            return
        size = sum(a.nbytes for a in _arrays(outcome))
        if key in self._at:
            return
        if size > SMALL and self._end + size > self._allowed:
            self._cut()
            return
        content = _encoded(outcome)
        checksum, length = zlib.crc32(key), sum(len(piece) for piece in content)
        for piece in content:
            checksum = zlib.crc32(piece, checksum)
        head, begin = _FRAME.pack(_KEY + length, checksum) + key, self._end
        try:
            for piece in (head, *content) if size > SMALL else (b"".join((head, *content)),):
                data = memoryview(piece)
                while data:
                    data = data[self._file.write(data) :]
        except OSError as error:
            self._file.truncate(begin)
            raise MachineError(
                f"The study folder {self.path.parent} cannot be written ({error.strerror}); repair that, or make room,"
                " and give the same command again."
            ) from None
        self._end = begin + len(head) + length
        self._at[key] = (self._end - length, length)

    def _cut(self) -> None:
        """Count an outcome that is left out; of the first one say it."""
        self.left_out += 1
        if self.left_out == 1:
            self._say(
                f"{self.path.name} is full at {self._end / 1e6:.0f} MB; further runs are not kept, and are simulated"
                " again where the study is interrupted and continued"
            )

    def remove(self) -> None:
        """Remove the file: the study is complete."""
        self.close()
        self.path.unlink(missing_ok=True)

    def close(self) -> None:
        """Close the file and release its lock."""
        self._file.close()

    def _load(self) -> None:
        size = os.fstat(self._file.fileno()).st_size
        head = os.pread(self._file.fileno(), len(_MAGIC), 0)
        if head != _MAGIC[: len(head)]:
            raise InputError(f"{self.path} is no log of runs; delete it, or choose another folder with -o.")
        if len(head) < len(_MAGIC):
            self._file.truncate(0)
            self._file.write(_MAGIC)
            self._end = len(_MAGIC)
            return
        self._end = len(_MAGIC)
        with self.path.open("rb") as reader:
            reader.seek(self._end)
            while (frame := reader.read(_FRAME.size)) and len(frame) == _FRAME.size:
                length, check = _FRAME.unpack(frame)
                record = reader.read(length) if length <= size - self._end else b""
                if len(record) < max(length, _KEY) or zlib.crc32(record) != check:
                    break
                start = self._end + _FRAME.size + _KEY
                self._at[record[:_KEY]] = (start, length - _KEY)
                self._end = start + length - _KEY
        if self._end < size:
            self._file.truncate(self._end)


class LoggedRunner(Closing):
    """A runner whose outcomes are kept in a log and looked up there; see ``Runner``."""

    def __init__(self, runner: Runner, log: RunLog, experiments: Sequence[Experiment], settings: Any) -> None:
        """``settings``: what else decides how an experiment is run."""
        self.notes = runner.notes
        self._runner = runner
        self._log = log
        archives: dict[Path, str] = {}
        self._keys = {e.name: _experiment_key(e, settings, archives) for e in experiments}

    def run(self, jobs: Sequence[Job], on_outcome: OnOutcome | None = None) -> list[Outcome]:
        """Look up what is known, run the rest; outcomes come in the order of the jobs."""
        jobs = list(jobs)
        keys = [_job_key(self._keys.get(job.experiment, b""), job) for job in jobs]
        outcomes: list[Outcome | None] = [self._log.known(key) for key in keys]
        missing = [index for index, outcome in enumerate(outcomes) if outcome is None]
        if on_outcome is not None:
            for index, outcome in enumerate(outcomes):
                if outcome is not None:
                    on_outcome(index, outcome)

        def note(position: int, outcome: Outcome) -> None:
            index = missing[position]
            self._log.append(keys[index], outcome)
            if on_outcome is not None:
                on_outcome(index, outcome)

        if missing:
            found = self._runner.run([jobs[index] for index in missing], note)
            for index, outcome in zip(missing, found, strict=True):
                outcomes[index] = outcome
        return [outcome for outcome in outcomes if outcome is not None]

    def close(self) -> None:
        """Close the runner; the log stays open."""
        self._runner.close()


# -- keys ---------------------------------------------------------------------------------------------
def _experiment_key(experiment: Experiment, settings: Any, archives: dict[Path, str]) -> bytes:
    if experiment.fmu not in archives:
        try:
            archives[experiment.fmu] = hashlib.sha256(experiment.fmu.read_bytes()).hexdigest()
        except OSError:
            archives[experiment.fmu] = ""  # its runs fail, and say why
    # Equal objects may pickle differently, which costs a run; different ones never pickle alike.
    what = (experiment.inputs, experiment.outputs, experiment.time, dict(experiment.fixed))
    limits = (experiment.tolerance, experiment.most_steps)
    how = (*limits, experiment.reduce, experiment.wrapper, settings, dict(experiment.texts))
    data = pickle.dumps((archives[experiment.fmu], what, how), pickle.HIGHEST_PROTOCOL)
    return hashlib.sha256(data).digest()


def _job_key(experiment: bytes, job: Job) -> bytes:
    digest = hashlib.sha256(experiment)
    for name in sorted(job.values):
        digest.update(f"{name}\0".encode() + struct.pack("<d", job.values[name]))
    digest.update(b"signals" if job.keep_signals else b"")
    return digest.digest()[:_KEY]


# -- records ------------------------------------------------------------------------------------------
def _arrays(outcome: Outcome) -> list[np.ndarray]:
    signals = outcome.signals
    own = [] if signals is None else [signals.time, *(signals[name] for name in signals.names)]
    return own if outcome.reduced is None else [*own, outcome.reduced]


def _encoded(outcome: Outcome) -> list[bytes | memoryview]:
    """What is kept of an outcome, in pieces: its arrays are not copied."""
    signals, reduced = outcome.signals, outcome.reduced
    meta: dict[str, Any] = {
        "status": str(outcome.status),
        "reason": outcome.reason,
        "duration_s": outcome.duration_s,
        "console": outcome.console,
        "reduced": None if reduced is None else list(reduced.shape),
        "single": reduced is not None and reduced.dtype == np.float32,
    }
    if signals is not None:
        meta["signals"] = {"names": list(signals.names), "units": dict(signals.units)}
        meta["signals"] |= {"held": sorted(signals.held), "n": signals.time.size}
    head = json.dumps(meta).encode()
    body = [
        np.ascontiguousarray(a, dtype="<f4" if a is reduced and meta["single"] else "<f8").reshape(-1)
        for a in _arrays(outcome)
    ]
    return [struct.pack("<I", len(head)) + head, *(a.view(np.uint8).data for a in body if a.size)]


def _meta(content: bytes) -> tuple[dict[str, Any], int]:
    (length,) = struct.unpack_from("<I", content)
    return json.loads(content[4 : 4 + length]), 4 + length


def _decoded(content: bytes) -> Outcome:
    meta, begin = _meta(content)
    signals = None
    if (kept := meta.get("signals")) is not None:
        n, count = kept["n"], len(kept["names"]) + 1
        numbers = np.frombuffer(content, dtype="<f8", count=n * count, offset=begin).astype(np.float64)
        begin += numbers.nbytes
        columns = [numbers[k * n : (k + 1) * n] for k in range(count)]
        signals = Signals(
            columns[0],
            dict(zip(kept["names"], columns[1:], strict=True)),
            kept["units"],
            frozenset(kept["held"]),
        )
    shape = meta["reduced"]
    stored, dtype = ("<f4", np.float32) if meta.get("single") else ("<f8", np.float64)
    return Outcome(
        Status(meta["status"]),
        meta["reason"],
        signals,
        None if shape is None else np.frombuffer(content, stored, offset=begin).astype(dtype).reshape(shape),
        meta["duration_s"],
        meta["console"],
    )


def _lock(path: Path, file: BinaryIO) -> None:
    """Keep a second process out of the same study (where the system has flock)."""
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(
            f"{path.parent} is in use by another run; wait for it or choose another folder with -o."
        ) from None
    except OSError:
        with contextlib.suppress(OSError):  # some network file systems have no locks
            fcntl.flock(file, fcntl.LOCK_UN)
