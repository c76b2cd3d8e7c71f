"""The .fmu file as a zip archive: digest, safe unpacking."""

import hashlib
import shutil
import stat
import zipfile
import zlib
from pathlib import Path, PurePosixPath

from thsa_cosim.errors import FmuError, did_you_mean_path
from thsa_cosim.fmu.machine import is_machines, temporary_fault

MAXIMUM_UNPACKED_BYTES = 8 * 2**30
"""Above this an archive is taken for a zip bomb."""
_RATIO = 50
"""Unpacked to packed size; libraries and texts of real FMUs stay below 20."""
_ALWAYS_BYTES = 512 * 2**20
"""So much may be unpacked from however small an archive."""
_ALWAYS_TEXT = 32 * 2**20
"""So long may a model description be in however small an archive."""


def sha256_of(path: Path) -> str:
    """Return the hex SHA-256 digest of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def open_archive(path: Path) -> zipfile.ZipFile:
    """Open ``path`` as a zip archive; FmuError says in one sentence why it is none."""
    if not path.exists():
        raise FmuError(f"{path} does not exist; name an .fmu file.{did_you_mean_path(path)}")
    if path.is_dir():
        raise FmuError(f"{path} is a folder; name an .fmu file.")
    if not path.is_file():  # a pipe would wait for ever
        raise FmuError(f"{path} is a pipe or device; name an .fmu file.")
    try:
        return zipfile.ZipFile(path)
    except PermissionError as error:
        raise FmuError(f"{path} cannot be read ({error.strerror}); allow it.") from None
    except (zipfile.BadZipFile, OSError) as error:
        raise FmuError(f"{path} is no zip archive and so no FMU ({error}).") from None


def _points_outside(name: str) -> bool:
    """Tell whether an entry's name leaves the folder that it is unpacked to."""
    posix = PurePosixPath(name.replace("\\", "/"))
    return posix.is_absolute() or ".." in posix.parts or ":" in (posix.parts or ("",))[0] or "\0" in name


def check_archive(path: Path, archive: zipfile.ZipFile) -> None:
    """Refuse entries that would be written outside ("zip slip"), links and zip bombs with FmuError."""
    total = 0
    for entry in archive.infolist():
        # orig_filename is what the file says; filename has been normalised already.
        if _points_outside(entry.orig_filename) or _points_outside(entry.filename):
            raise FmuError(
                f"{path} holds the entry {entry.orig_filename!r}, which points outside the archive."
            )
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise FmuError(f"{path} holds the symbolic link {entry.filename!r}; an FMU has no need of links.")
        total += entry.file_size
    packed = path.stat().st_size
    if total > min(MAXIMUM_UNPACKED_BYTES, max(_ALWAYS_BYTES, _RATIO * packed)):
        raise FmuError(
            f"{path} would unpack to {total / 2**30:.1f} GiB from {packed / 2**20:.1f} MiB, which no FMU needs."
        )


def read_text(path: Path, archive: zipfile.ZipFile, name: str) -> bytes:
    """Return an entry that is to be parsed; KeyError if there is none, FmuError if it is absurdly long."""
    size, packed = archive.getinfo(name).file_size, path.stat().st_size
    if size > max(_ALWAYS_TEXT, _RATIO * packed):
        raise FmuError(
            f"{path}: {name} has {size / 2**20:.0f} MiB in an archive of {packed / 2**20:.1f} MiB, which no FMU needs."
        )
    return archive.read(name)


def unpack(path: Path, folder: Path) -> Path:
    """Unpack the FMU ``path`` into ``folder`` (created) and return it.

    Nothing is written if any entry points outside ``folder``; a folder begun is removed on failure.
    MachineError if the disk, and not the archive, is at fault.
    """
    with open_archive(path) as archive:
        check_archive(path, archive)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for entry in archive.infolist():
                entry.filename = entry.filename.replace(
                    "\\", "/"
                )  # some tools on Windows write their separator
                archive.extract(entry, folder)
            (folder / "resources").mkdir(exist_ok=True)  # an FMU is told where it is, and may look
        except (
            zipfile.BadZipFile,
            zlib.error,
            OSError,
            NotImplementedError,
            RuntimeError,
            EOFError,
        ) as error:
            shutil.rmtree(folder, ignore_errors=True)
            if isinstance(error, OSError) and (is_machines(error) or not folder.parent.is_dir()):
                raise temporary_fault(error) from None
            raise FmuError(f"{path} cannot be unpacked ({error}).") from None
    return folder
