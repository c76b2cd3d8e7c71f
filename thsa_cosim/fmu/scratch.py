"""Temporary folders that do not outlive their process, not even one that was killed."""

import contextlib
import os
import shutil
import tempfile
from pathlib import Path
from typing import IO

from thsa_cosim.fmu.machine import temporary_fault

_PREFIX = "thsa-cosim-"
_LOCK = "in-use"


class ScratchFolder:
    """A temporary folder; ``remove`` deletes it.

    Its owner keeps a lock on a file inside. What a killed process has left behind is therefore recognised,
    and deleted when the next folder is made.
    """

    def __init__(self) -> None:
        """Make the folder; remove those whose owners are gone. MachineError if there is no place for it."""
        _sweep()
        try:
            self.path = Path(tempfile.mkdtemp(prefix=_PREFIX))
        except OSError as error:
            raise temporary_fault(error) from None
        self._lock = _take_lock(self.path)

    def remove(self) -> None:
        """Delete the folder with all that is in it; safe to call twice."""
        shutil.rmtree(self.path, ignore_errors=True)
        if self._lock is not None:
            self._lock.close()
            self._lock = None


def _take_lock(folder: Path) -> IO[bytes] | None:
    try:
        import fcntl
    except ImportError:
        return None
    partial = folder / f"{_LOCK}.part"
    file = partial.open("wb")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        partial.rename(folder / _LOCK)  # only now can a sweep see it
    except OSError:
        file.close()
        return None
    return file


def _sweep() -> None:
    """Delete folders of this user that nobody has locked any more."""
    try:
        import fcntl
    except ImportError:
        return
    with contextlib.suppress(OSError):
        for lock in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*/{_LOCK}"):
            with contextlib.suppress(OSError):
                if lock.stat().st_uid != os.getuid():
                    continue
                with lock.open("rb") as file:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(lock.parent, ignore_errors=True)
