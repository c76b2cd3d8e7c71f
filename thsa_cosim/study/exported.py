"""FMUs that are kept in a study folder: beside each one a note of what it was made from."""

import json
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import thsa_cosim
from thsa_cosim import __version__
from thsa_cosim.study.digest import digest_of_file, digest_of_folder, digest_of_text
from thsa_cosim.study.identity import MODELICA

#: Packages that have a part in an export.
_TOOLS = ("casadi", "fmpy", "ziglang")


def export_digest(source: str, package: Path, platforms: Sequence[str] | None) -> str:
    """Digest of all that an FMU is made from: class, package, platforms, front end, exporter and their tools."""
    tools = {"thsa-cosim": __version__}
    for tool in _TOOLS:
        try:
            tools[tool] = version(tool)
        except PackageNotFoundError:  # exporting will say so
            continue
    # Not imported for that: only an export itself needs the exporter.
    exporter = [
        digest_of_folder(Path(thsa_cosim.__file__).parent / room, ["*.py", "*.c", "*.h"])
        for room in ("modelica", "export")
    ]
    return digest_of_text(
        source, digest_of_folder(package, MODELICA), json.dumps([platforms, tools], sort_keys=True), *exporter
    )


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


def _note(fmu: Path) -> Path:
    return fmu.with_suffix(".made-from.json")
