"""What exports keep in the user's cache folder, so that one leaves it to the next.

A cache that cannot be read or written is none: nothing fails for it.
"""

import contextlib
import os
import shutil
import sys
from pathlib import Path


def cache_folder(room: str) -> Path | None:
    """Folder of the user's cache for one kind of file, made or not; None where nothing is to be kept.

    ``THSA_COSIM_CACHE``, if set, stands in place of ``thsa-cosim`` in the user's cache; empty, nothing is kept.
    """
    root = os.environ.get("THSA_COSIM_CACHE")
    if root is None:
        home = os.environ.get("LOCALAPPDATA" if sys.platform == "win32" else "XDG_CACHE_HOME")
        try:
            root = str((Path(home) if home else Path.home() / ".cache") / "thsa-cosim")
        except RuntimeError:  # no home
            return None
    return Path(root) / room if root else None


def keep(file: Path, kept: Path, most: int) -> None:
    """Copy ``file`` to ``kept``, whole or not at all, and forget all but the ``most`` newest of that folder."""
    with contextlib.suppress(OSError):
        kept.parent.mkdir(parents=True, exist_ok=True)
        partial = kept.with_name(f"{kept.name[:64]}.{os.getpid()}.part")
        try:
            shutil.copyfile(file, partial)
            partial.replace(kept)
        finally:
            partial.unlink(missing_ok=True)
        known = sorted(kept.parent.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
        for path in known[most:]:
            path.unlink(missing_ok=True)
