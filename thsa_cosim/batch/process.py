"""One worker process, seen from the runner."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections import deque
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np

from thsa_cosim import threads
from thsa_cosim.batch import supervisor
from thsa_cosim.batch.frames import Order, Recall, Setup, Stop, pack
from thsa_cosim.batch.inbox import Event, Inbox
from thsa_cosim.batch.memory import resident_bytes
from thsa_cosim.batch.worker import BEGAN, GROWTH, PROGRESS_SLOTS, SERIAL, read_console
from thsa_cosim.fmu.instance import Phase
from thsa_cosim.system.member import AT_WORK

_BOOT = ("-P", str(Path(supervisor.__file__)))
"""The supervisor as a script, without its folder in sys.path."""
_PATIENCE_S = 3.0
"""How long a supervisor may take to end a worker and its family."""
_FLOOD = 2**20
"""Bytes of console output above which the file is emptied while the run goes on."""


@dataclass(frozen=True)
class Progress:
    """How far a worker is."""

    serial: int
    """The job in work, 0 for none."""
    where: str
    growth: int
    """Bytes by which the job in work has grown the process, if a limit is set."""
    began: float | None
    """When its FMU was first touched (time.monotonic); None: not yet."""
    place: tuple[float, ...] = ()
    """Phase, time, step: two deaths at the same place are the FMU's doing."""
    component: int = 0
    """Number of the component of a system that was at work, from 1; 0 for none."""


class WorkerProcess:
    """A spawned worker: sends orders, queues what comes back, explains its death.

    Its messages arrive in ``inbox``, under this object.
    """

    def __init__(self, setup: Setup, folder: Path, inbox: Inbox) -> None:
        self.folder = folder
        self.assigned: deque[Order] = deque()
        """Orders sent and not yet answered; the first one is in work."""
        self.is_ready = False
        self.is_leaving = False
        self.is_recalled = False
        self.runs = 0
        self.given = 0
        """Orders that it was ever given; a fresh worker has had none."""
        self.silent_ticks = 0
        """How often it was seen between two jobs while an answer was awaited."""
        self.lost_supervisor = False
        """Whether ``reap`` found that the supervisor did not end by itself."""
        self.worker_pid = 0
        """0 until it is ready."""
        self._outbox = b""
        self.idle_rss = 0
        self.since = time.monotonic()
        """When the worker went over to the first of ``assigned``; before that, when it was started."""
        self.last_progress = Progress(0, "", 0, None)
        """What ``reap`` found."""
        self.last_words: list[Event] = []
        """What had arrived, or was on its way, when the process was reaped."""
        self._heads: dict[int, str] = {}
        """How the console of a job began that prints so much that the file was emptied, by the job's serial."""
        self._console_limit = setup.console_limit
        (folder / "cwd").mkdir(parents=True)
        self._progress_path = folder / "progress"
        self._progress_path.write_bytes(bytes(8 * PROGRESS_SLOTS))
        paths = [str(Path(p).absolute()) for p in sys.path]
        environment = os.environ | dict.fromkeys(threads.ALL, "1") | {supervisor.TAG: str(folder)}
        with (folder / "console").open("ab") as console:
            self._process = subprocess.Popen(
                [sys.executable, *_BOOT, json.dumps(paths), setup.root],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=console,
                cwd=folder / "cwd",
                env=environment,
                start_new_session=True,
            )
        self._stdin = cast(BinaryIO, self._process.stdin)
        if os.name != "nt":
            os.set_blocking(self._stdin.fileno(), False)  # a stopped worker does not read
        self._inbox = inbox
        inbox.add(self, cast(BinaryIO, self._process.stdout))
        self._send(replace(setup, folder=str(folder)))

    @property
    def pid(self) -> int:
        """Process id; that of the supervisor until the worker is ready."""
        return self.worker_pid or self._process.pid

    @property
    def is_fresh(self) -> bool:
        """Whether it was given nothing yet."""
        return not self.given and not self.is_leaving

    def _send(self, message: Any) -> None:
        self._outbox += pack(message)
        self._flush()

    def _flush(self) -> None:
        """Send what the pipe takes now."""
        # A dead worker is noticed by the end of its pipe; what was sent to it is not lost but requeued.
        with contextlib.suppress(OSError, ValueError):
            while self._outbox:
                self._outbox = self._outbox[os.write(self._stdin.fileno(), self._outbox) :]

    def give(self, orders: list[Order]) -> None:
        """Send orders; the worker runs them after those it already has."""
        if self.is_ready and not self.assigned:
            self.since = time.monotonic()
        self.given += len(orders)
        self.assigned.extend(orders)
        self._send(orders)

    def recall(self) -> None:
        """Ask for the orders that are not begun; ``Returned`` is the answer."""
        self.is_recalled = True
        self._send(Recall())

    def progress(self) -> "Progress":
        """Return how far the worker is; also after its death."""
        values = np.zeros(PROGRESS_SLOTS)
        with contextlib.suppress(OSError, ValueError):
            values = np.frombuffer(self._progress_path.read_bytes(), dtype=np.float64)
        values = np.nan_to_num(values)  # whatever an FMU has written there
        phase = Phase(int(values[0])) if values[0] in list(Phase) else Phase.IDLE
        where = {
            Phase.STEP: f"while stepping at t = {values[1]:.9g} s",
            Phase.LOAD: "while loading the FMU",
            Phase.INSTANTIATE: "while instantiating",
            Phase.INITIALIZE: "while initialising",
            Phase.TERMINATE: "while terminating",
            Phase.FREE: "while freeing the instance",
            Phase.RESET: "while resetting",
            Phase.REDUCE: "in the cost",
            Phase.IDLE: "after the run",
        }
        return Progress(
            int(values[SERIAL]),
            where[phase],
            int(values[GROWTH]),
            float(values[BEGAN]) or None,
            tuple(values[:3].tolist()),
            int(values[AT_WORK]),
        )

    def console(self) -> str:
        """Return what the worker printed since its last finished run, cut."""
        return self.whole_console(self.progress().serial, read_console(self.folder, self._console_limit))

    def whole_console(self, serial: int, rest: str) -> str:
        """Return what a job printed, cut: before the file was emptied, and the ``rest`` since then."""
        head = self._heads.pop(serial, "")
        if not head:
            return rest
        whole = head + rest
        return whole[: self._console_limit] + ("\n... (cut)" if len(whole) > self._console_limit else "")

    def watch(self) -> int:
        """Stop floods of output; return by how many resident bytes the worker has grown."""
        self._flush()
        console = self.folder / "console"
        with contextlib.suppress(OSError):
            if console.stat().st_size > _FLOOD:
                serial = self.progress().serial  # ``assigned`` lags: a predecessor's answer may be on its way
                head = read_console(self.folder, self._console_limit)
                os.truncate(console, 0)
                if self.progress().serial == serial:
                    self._heads.setdefault(serial, head)
        return resident_bytes(self.pid) - self.idle_rss if self.idle_rss else 0

    def reap(self) -> int:
        """Kill what is left of the worker and its descendants, remove its folder; return the exit code.

        The exit code is negative for a signal, as in ``subprocess``.
        """
        if self._process.returncode is None:
            # The supervisor kills the worker and its family, and ends as the worker did.
            with contextlib.suppress(OSError):
                self._process.terminate()
            try:
                self._process.wait(_PATIENCE_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
            if self._process.returncode == -signal.SIGKILL and os.name != "nt":
                # It may be the supervisor itself that was killed.
                supervisor.end_family(str(self.folder))
        self.lost_supervisor = os.name != "nt" and not (self.folder / supervisor.ENDED).exists()
        self.last_progress = self.progress()
        with contextlib.suppress(OSError):
            self._stdin.close()
        self.last_words += self._inbox.remove(self)
        shutil.rmtree(self.folder, ignore_errors=True)
        return int(self._process.returncode)

    def has_died(self) -> bool:
        """Whether the process has ended; it is not reaped yet."""
        if self._process.returncode is not None or not hasattr(os, "waitid"):
            return self._process.poll() is not None
        with contextlib.suppress(OSError):
            return os.waitid(os.P_PID, self._process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None
        return True

    def ask_to_stop(self) -> None:
        """Tell the worker to end after the orders that it has."""
        self._send(Stop())

    def ends_within(self, patience_s: float) -> bool:
        """Wait for the worker to end by itself; return whether it did."""
        until = time.monotonic() + patience_s
        while not (died := self.has_died()) and time.monotonic() < until:
            time.sleep(0.002)
        return died

    def join(self, patience_s: float) -> int:
        """Wait for the worker to end by itself, then reap it."""
        self.ends_within(patience_s)
        return self.reap()
