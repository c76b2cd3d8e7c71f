"""Faults that are the machine's and not the FMU's: which they are, and what helps."""

import errno
import os
import tempfile
from pathlib import Path

from thsa_cosim.errors import MachineError

_FULL = {errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)}
_FORBIDDEN = {errno.EROFS, errno.EACCES, errno.EPERM}
_GONE = {errno.ENOENT, errno.ENOTDIR, getattr(errno, "ESTALE", errno.ENOENT)}
_SCARCE = {errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EAGAIN}
_BROKEN = {errno.EIO}


def is_machines(error: OSError) -> bool:
    """Tell whether the machine is to blame for an error, wherever it was raised."""
    return error.errno in _FULL | _SCARCE | _BROKEN | {errno.EROFS}


def temporary_fault(error: OSError, folder: Path | str | None = None) -> MachineError:
    """Return what an error while using the temporary folder means, with its remedy."""
    place = f"The temporary folder {folder or _temporary()}"
    if error.errno in _SCARCE:
        return MachineError(
            f"The system refused memory, files or processes ({error.strerror}); use fewer workers, or close "
            f"other programs, and give the same command again."
        )
    if error.errno in _FULL:
        return MachineError(f"{place} is full; {_remedy('make room there')}.")
    if error.errno in _GONE:
        return MachineError(f"{place} was removed while it was in use; {_remedy('keep it')}.")
    if error.errno in _FORBIDDEN:
        return MachineError(f"{place} cannot be written ({error.strerror}); {_remedy('allow it')}.")
    return MachineError(f"{place} cannot be used ({error.strerror or error}); {_remedy('repair it')}.")


def refuse_noexec(folder: Path) -> None:
    """MachineError where nothing in ``folder`` may be executed, so that no FMU's library can be loaded."""
    flag = getattr(os, "ST_NOEXEC", 0)
    if flag and os.statvfs(folder).f_flag & flag:
        raise MachineError(
            f"The temporary folder {folder.parent} is mounted noexec, so no FMU can be loaded from it; "
            f"{_remedy('mount it with exec')}."
        )


def _temporary() -> str:
    try:
        return tempfile.gettempdir()
    except OSError:
        return os.environ.get("TMPDIR", "")


def _remedy(first: str) -> str:
    return f"{first}, or set TMPDIR to another folder, and give the same command again"
