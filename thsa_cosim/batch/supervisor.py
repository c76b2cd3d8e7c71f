"""The process between a runner and one worker: it never runs FMU code, and leaves nothing behind.

Run as a script (``python -P supervisor.py PATHS ROOT``), so that it forks before anything is imported. It waits
for the worker, ends what the worker's FMU has started, and ends as the worker did. Where its orders pipe loses
its last writer the runner is dead: it then ends the worker and removes the runner's temporary folder, which no
worker may touch.
"""

import contextlib
import json
import os
import select
import shutil
import signal
import sys
import time
from typing import NoReturn

TAG = "THSA_COSIM_WORKER"
"""Environment variable that all descendants of a worker have; its value is the worker's folder."""
ENDED = "ended"
"""File in a worker's folder that its supervisor leaves; without it the supervisor itself was killed."""
_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36


def prctl(option: int, value: int) -> None:
    """Set an attribute of this process (Linux; elsewhere nothing happens)."""
    with contextlib.suppress(Exception):
        import ctypes

        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


def adopt_orphans() -> None:
    """Become the parent of all descendants whose own parent ends (Linux)."""
    prctl(_PR_SET_CHILD_SUBREAPER, 1)


def family(folder: str) -> list[int]:
    """Return the processes that carry the tag of a worker in ``folder``, but this one and its parent (Linux)."""
    tag = f"{TAG}={folder}".encode()
    found = []
    with contextlib.suppress(OSError):
        for name in os.listdir("/proc"):  # noqa: PTH208 - standard library only, and often
            if name.isdigit() and int(name) not in (os.getpid(), os.getppid()):
                with contextlib.suppress(OSError), open(f"/proc/{name}/environ", "rb") as file:  # noqa: PTH123
                    entries = file.read().split(b"\0")
                    if any(e == tag or e.startswith(tag + b"/") for e in entries):
                        found.append(int(name))
    return found


def end_family(folder: str, spare: int = 0) -> None:
    """Kill the processes that carry the tag of ``folder``, whatever session they are in."""
    for _ in range(20):  # one that forks faster than it is found
        members = [pid for pid in family(folder) if pid != spare]
        if not members:
            return
        for pid in members:
            with contextlib.suppress(OSError):
                os.kill(pid, signal.SIGKILL)
        time.sleep(0.002)


def _wait_for_turn(root: str) -> None:
    """Wait until no other supervisor clears ``root``: two that end each other at once would leave it behind."""
    with contextlib.suppress(ImportError, OSError):
        import fcntl

        fcntl.flock(os.open(root, os.O_RDONLY), fcntl.LOCK_EX)  # released where this process ends


def _supervise(worker: int, folder: str, root: str) -> NoReturn:
    signal.signal(signal.SIGTERM, lambda *_: os.kill(worker, signal.SIGKILL))
    poll = select.poll()
    poll.register(0, 0)  # no more than that the last writer is gone
    patience = 20
    with contextlib.suppress(AttributeError, OSError):
        poll.register(os.pidfd_open(worker), select.POLLIN)
        patience = 1000
    orphaned = False
    while not os.waitid(os.P_PID, worker, os.WEXITED | os.WNOHANG | os.WNOWAIT):
        for descriptor, _ in poll.poll(patience):
            if descriptor == 0:
                orphaned = True
                poll.unregister(0)
                os.kill(worker, signal.SIGKILL)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    _, status = os.waitpid(worker, 0)
    with contextlib.suppress(OSError), open(os.path.join(folder, ENDED), "wb"):  # noqa: PTH118, PTH123
        pass
    if orphaned:
        _wait_for_turn(root)
    end_family(root if orphaned else folder)
    until = time.monotonic() + 1.0
    with contextlib.suppress(ChildProcessError):
        while time.monotonic() < until:  # orphans that came to us
            if os.waitpid(-1, os.WNOHANG)[0] == 0:
                time.sleep(0.001)
    if orphaned:
        shutil.rmtree(root, ignore_errors=True)
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        if number not in (signal.SIGKILL, signal.SIGSTOP):
            signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)
    os._exit(os.waitstatus_to_exitcode(status) & 0xFF)


def main() -> None:
    """Fork the worker and supervise it; without fork (Windows) be the worker."""
    sys.path[:] = json.loads(sys.argv[1])
    root, folder = sys.argv[2], os.environ.get(TAG, "")
    if hasattr(os, "fork"):
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        with contextlib.suppress(ImportError, OSError, ValueError):
            import resource

            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        adopt_orphans()
        supervisor, worker = os.getpid(), os.fork()
        if worker:
            os.setpgid(worker, worker)
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, 1)  # the results pipe ends with the worker
            os.dup2(null, 2)
            os.chdir("/")
            _supervise(worker, folder, root)
        with contextlib.suppress(OSError):
            os.setpgid(0, 0)
        prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != supervisor:
            os._exit(1)
    from thsa_cosim.batch.worker import main as work

    work(root)


if __name__ == "__main__":
    main()
