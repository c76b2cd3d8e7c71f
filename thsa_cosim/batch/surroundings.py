"""What an FMU finds in a worker process and may change: put back after every run, or the process ends.

Descriptors, floating-point mode, working directory, environment, locale, file mask, timers, children. What cannot
be seen or put back (a thread that stays, the heap) costs at most the worker: a run that dies is tried again in a
fresh one.
"""

import contextlib
import ctypes
import os
import signal
import time
from pathlib import Path

from thsa_cosim.batch.supervisor import adopt_orphans

_HIGH = 700
"""Descriptors of ours lie above this, where an FMU that closes or writes to the low ones does not meet them."""
_LEAKED = 256
_LC_ALL = 6


def out_of_reach(descriptor: int) -> int:
    """Return a duplicate of a descriptor with a high number that no child inherits; close the original."""
    try:
        import fcntl
        import resource

        soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        high = _HIGH if soft == resource.RLIM_INFINITY else min(_HIGH, soft // 2)
        moved = fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, high)
    except ImportError:
        moved = os.dup(descriptor)
    os.close(descriptor)
    return moved


def _identity(descriptor: int) -> tuple[int, int, int] | None:
    try:
        found = os.fstat(descriptor)
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_mode


class Surroundings:
    """The state of this process that FMUs share, as it was before the first of them."""

    def __init__(self, folder: Path, channels: tuple[int, ...]) -> None:
        """Remember the state; ``channels`` are the descriptors of the pipes to the runner."""
        self._pid = os.getpid()
        self._cwd = folder / "cwd"
        self._console = folder / "console"
        self._channels = {descriptor: _identity(descriptor) for descriptor in channels}
        self._standard = {descriptor: _identity(descriptor) for descriptor in (0, 1, 2)}
        self._mask = os.umask(0o022)
        os.umask(self._mask)
        self._libc = None if os.name == "nt" else ctypes.CDLL(None)
        self._floating = ctypes.create_string_buffer(256)
        self._libm = None
        if self._libc is not None:
            adopt_orphans()
            self._libc.setlocale.restype = ctypes.c_char_p
            self._libc.setlocale.argtypes = [ctypes.c_int, ctypes.c_char_p]
            self._locale = self._libc.setlocale(_LC_ALL, None)
            self._environ = ctypes.c_void_p.in_dll(self._libc, "environ")
            self._pointers, self._strings = self._environment()
            with contextlib.suppress(OSError, AttributeError):
                self._libm = ctypes.CDLL("libm.so.6")
                self._libm.fegetenv(self._floating)

    def prepare(self) -> None:
        """Go to the worker's own folder, before a run."""
        try:
            os.chdir(self._cwd)
        except OSError:  # the FMU has removed it
            self._cwd.mkdir(parents=True, exist_ok=True)
            os.chdir(self._cwd)

    def leave_if_forked(self) -> None:
        """End this process if it is a copy that an FMU's ``fork`` has made of the worker."""
        if os.getpid() != self._pid:
            os._exit(0)

    def floating_point(self) -> None:
        """Put rounding and traps back."""
        if self._libm is not None:
            self._libm.fesetenv(self._floating)

    def restore(self) -> str:
        """Put back what can be; return why the process has to end nevertheless, or an empty string."""
        self.leave_if_forked()
        self.floating_point()
        os.umask(self._mask)
        self.prepare()
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        if self._libc is not None:
            if self._libc.setlocale(_LC_ALL, None) != self._locale:
                self._libc.setlocale(_LC_ALL, self._locale)
            self._restore_environment()
        if any(_identity(d) != known for d, known in self._channels.items()):
            return "the FMU closed or replaced the worker's descriptors"
        self._restore_standard()
        if not (self._cwd.parent / "progress").exists():
            return "the FMU deleted the worker's folder"
        return self._children()

    # -- parts ------------------------------------------------------------------------------------------
    def _environment(self) -> tuple[bytes, list[bytes]]:
        """The environment as C sees it: the array of pointers, and the strings."""
        if not self._environ.value:
            return b"", []
        size = ctypes.sizeof(ctypes.c_void_p)
        array = ctypes.cast(self._environ.value, ctypes.POINTER(ctypes.c_char_p))
        strings: list[bytes] = []
        while (entry := array[len(strings)]) is not None:
            strings.append(entry)
        return ctypes.string_at(self._environ.value, size * len(strings)), strings

    def _restore_environment(self) -> None:
        assert self._libc is not None
        here = self._environ.value
        # The pointers change with every setenv or putenv; reading so many bytes more costs nothing.
        if here and ctypes.string_at(here, len(self._pointers) + 8) == self._pointers + bytes(8):
            return
        self._libc.clearenv()
        for entry in self._strings:
            name, _, value = entry.partition(b"=")
            self._libc.setenv(name, value, 1)
        self._pointers, _ = self._environment()

    def _restore_standard(self) -> None:
        for descriptor, known in self._standard.items():
            if _identity(descriptor) == known:
                continue
            path, flags = (os.devnull, os.O_RDONLY) if descriptor == 0 else (self._console, os.O_WRONLY)
            found = os.open(path, flags | (os.O_APPEND | os.O_CREAT if descriptor else 0))
            if found != descriptor:
                os.dup2(found, descriptor)
                os.close(found)
            self._standard[descriptor] = _identity(descriptor)

    def _children(self) -> str:
        """Wait a moment for what the FMU has started; say so if it stays."""
        if not hasattr(os, "waitpid") or os.name == "nt":
            return ""
        until = time.monotonic() + 0.05
        with contextlib.suppress(ChildProcessError):
            while time.monotonic() < until:
                if os.waitpid(-1, os.WNOHANG)[0] == 0:
                    time.sleep(0.001)
            return "the FMU left processes behind"
        return ""


def descriptors_leak(before: int) -> bool:
    """Tell whether so many more descriptors are open than ``before`` that the process should be replaced."""
    return open_descriptors() - before > _LEAKED


def open_descriptors() -> int:
    """How many descriptors this process has open, 0 if unknown."""
    try:
        return len(os.listdir("/proc/self/fd"))  # noqa: PTH208 - after every run
    except OSError:
        return 0
