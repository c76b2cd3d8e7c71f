"""FMUs that are kept in a study folder: beside each one a note of what it was made from.

Another study of the same user that is to make the same FMU takes it from the user's cache folder.
"""

import contextlib
import hashlib
import json
import os
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import thsa_cosim
from thsa_cosim import __version__
from thsa_cosim.shipped import shipped
from thsa_cosim.study.digest import digest_of_file, digest_of_folder, digest_of_text
from thsa_cosim.study.identity import MODELICA

#: Packages that have a part in an export.
_TOOLS = ("casadi", "fmpy", "ziglang")
#: Rooms that have a part in an export.
_ROOMS = ("modelica", "export", "fmu", "system")
#: FMUs that are kept for other studies; those that were used longest ago go first.
KEPT = 32


def export_digest(source: str, package: Path, platforms: Sequence[str] | None) -> str:
    """Digest of all that an FMU is made from: class, packages, platforms, front end, exporter and their tools.

    ``package`` is the class's own; that of the shipped blocks, which any class may use, counts, too.
    """
    tools = {"thsa-cosim": __version__}
    for tool in _TOOLS:
        try:
            tools[tool] = version(tool)
        except PackageNotFoundError:  # exporting will say so
            continue
    if "ziglang" not in tools:
        from thsa_cosim.export.compile import compiler_version

        tools["compiler"] = compiler_version() or ""
    # Not imported for that: only an export itself needs the exporter.
    exporter = [
        digest_of_folder(Path(thsa_cosim.__file__).parent / room, ["*.py", "*.c", "*.h"]) for room in _ROOMS
    ]
    packages = [digest_of_folder(folder, MODELICA) for folder in (package, shipped("modelica", "THSA"))]
    return digest_of_text(source, *packages, json.dumps([platforms, tools], sort_keys=True), *exporter)


def is_made_from(fmu: Path, digest: str) -> bool:
    """Whether ``fmu`` is there as it was written, and was made from what ``digest`` stands for."""
    try:
        note = json.loads(_note(fmu).read_text(encoding="utf-8"))
        return bool(note == {"made from": digest, "sha256": digest_of_file(fmu)})
    except (OSError, ValueError):
        return False


def note_made_from(fmu: Path, digest: str) -> None:
    """Keep beside ``fmu`` what it was made from."""
    partial = _note(fmu).with_suffix(".part")
    partial.write_text(
        json.dumps({"made from": digest, "sha256": digest_of_file(fmu)}) + "\n", encoding="utf-8"
    )
    partial.replace(_note(fmu))


def take_kept(fmu: Path, digest: str) -> bool:
    """Write to ``fmu`` what another study has made from what ``digest`` stands for; False if nothing is kept.

    What is kept bears its own digest in its name: a damaged file is forgotten. OSError if ``fmu`` cannot be written.
    """
    content = _kept_content(digest)
    if content is not None:
        fmu.write_bytes(content)
    return content is not None


def _kept_content(digest: str) -> bytes | None:
    folder = _kept_folder()
    with contextlib.suppress(OSError):
        for kept in folder.glob(f"{digest}-*.fmu") if folder else ():
            content = kept.read_bytes()
            if kept.stem == f"{digest}-{hashlib.sha256(content).hexdigest()}":
                with contextlib.suppress(OSError):  # a cache that can only be read
                    kept.touch()
                return content
            kept.unlink()
    return None


def keep(fmu: Path, digest: str) -> None:
    """Keep a copy of ``fmu`` for other studies; where that cannot be, nothing happens."""
    from thsa_cosim.export import cache

    folder = _kept_folder()
    if folder is not None:
        cache.keep(fmu, folder / f"{digest}-{digest_of_file(fmu)}.fmu", KEPT)


def _kept_folder() -> Path | None:
    """Where FMUs are kept between studies; nowhere with further libraries, which no digest knows."""
    from thsa_cosim.export.cache import cache_folder

    return None if os.environ.get("MODELICAPATH") else cache_folder("fmus")


def _note(fmu: Path) -> Path:
    return fmu.with_suffix(".made-from.json")
