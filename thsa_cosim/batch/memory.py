"""How much memory a process uses, and a limit on it (Linux; elsewhere there is no limit)."""

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterator
from pathlib import Path

_PAGE = os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 4096


def _statm(pid: int | str) -> list[int]:
    try:
        with open(f"/proc/{pid}/statm", "rb", buffering=0) as file:  # noqa: PTH123 - read very often
            return [int(field) * _PAGE for field in file.read().split()]
    except (OSError, ValueError):
        return [0] * 7


def resident_bytes(pid: int | str = "self") -> int:
    """Resident set size, 0 if unknown."""
    return _statm(pid)[1]


class ResidentMeter:
    """Resident bytes of this process, cheap enough to ask after every run."""

    def __init__(self) -> None:
        self._statm: int | None = None
        with contextlib.suppress(OSError):
            self._statm = os.open("/proc/self/statm", os.O_RDONLY)

    def read(self) -> int:
        """Return the resident set size, 0 if unknown."""
        try:
            return 0 if self._statm is None else int(os.pread(self._statm, 128, 0).split()[1]) * _PAGE
        except (OSError, ValueError, IndexError):  # an FMU has closed the descriptor
            return resident_bytes()


def private_bytes() -> int:
    """Private writable memory of this process (heap, data, anonymous mappings), 0 if unknown."""
    return _statm("self")[5]


def limit_growth(limit: int) -> int:
    """Let this process's private writable memory grow by at most ``limit`` bytes; return what it has now.

    RLIMIT_DATA counts heap and private mappings (Linux 4.7 and later), so neither shared libraries nor
    numpy's and numba's address space reservations count, which makes RLIMIT_AS unusable for small limits.
    """
    present = private_bytes()
    if not sys.platform.startswith("linux"):
        return present
    import resource

    bound = present + limit
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    if hard != resource.RLIM_INFINITY:
        bound = min(bound, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (bound, hard))
    return present


@contextlib.contextmanager
def kept() -> Iterator[None]:
    """Freed arrays of any size stay with this process (glibc), to be used again without a fault for every page.

    By default those of more than 128 KiB go back to the system at once. `give_back` works as ever.
    """
    with contextlib.suppress(OSError, AttributeError):
        _set_thresholds(_LARGE, _LARGE)
    try:
        yield
    finally:
        with contextlib.suppress(OSError, AttributeError):
            _set_thresholds(_MMAP_DEFAULT, _TRIM_DEFAULT)
        give_back()


#: ``mallopt(3)``: parameters and their defaults in bytes.
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3
_TRIM_DEFAULT = _MMAP_DEFAULT = 128 * 1024
_LARGE = 2**30


def _set_thresholds(mmap: int, trim: int) -> None:
    """AttributeError where there is no ``mallopt``."""
    if sys.platform.startswith("linux"):
        library = ctypes.CDLL(None)
        library.mallopt(_M_MMAP_THRESHOLD, mmap)
        library.mallopt(_M_TRIM_THRESHOLD, trim)


def give_back() -> None:
    """Return freed memory to the system: glibc keeps what lies between arrays that live on."""
    if sys.platform.startswith("linux"):
        with contextlib.suppress(OSError, AttributeError):  # another C library
            ctypes.CDLL(None).malloc_trim(0)


def no_core_files() -> None:
    """A crashing FMU shall not leave core files behind."""
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def kills_for_memory() -> int:
    """How many processes the system has killed for want of memory since it started (Linux, else 0)."""
    with contextlib.suppress(OSError, ValueError):
        for line in Path("/proc/vmstat").read_text().splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0
