"""Files, folders and recordings as digests: equal if and only if what they stand for is equal."""

import hashlib
from collections.abc import Iterable
from pathlib import Path

from thsa_cosim.recordings import Recording


def digest_of_text(*texts: str) -> str:
    """SHA-256 of texts, hexadecimal; where one ends and the next begins counts."""
    digest = hashlib.sha256()
    for text in texts:
        data = text.encode()
        digest.update(f"{len(data)}:".encode() + data)
    return digest.hexdigest()


def digest_of_folder(folder: Path, patterns: Iterable[str]) -> str:
    """SHA-256 of the files below ``folder`` that match one of the glob ``patterns``: their names and contents.

    Line ends do not count, so that a checkout on Windows is the same. A folder that is not there has no files.
    Raises OSError if a file cannot be read.
    """
    files = {path for pattern in patterns for path in folder.rglob(pattern) if path.is_file()}
    digest = hashlib.sha256()
    for path in sorted(files, key=lambda path: path.relative_to(folder).as_posix()):
        content = path.read_bytes().replace(b"\r\n", b"\n")
        digest.update(f"{path.relative_to(folder).as_posix()}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()


def digest_of_file(file: Path) -> str:
    """SHA-256 of a file's content, hexadecimal; OSError if it cannot be read."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def digest_of_recording(recording: Recording) -> str:
    """SHA-256 of a recording as it is used: its samples after renaming, conversion and cutting."""
    digest = hashlib.sha256()
    signals = recording.signals
    digest.update(signals.time.tobytes())
    for name in signals.names:
        digest.update(name.encode())
        digest.update(signals[name].tobytes())
    digest.update(str(recording.lead_in).encode())
    for name, value in recording.start.items():
        digest.update(f"{name}={value!r}".encode())
    return digest.hexdigest()
