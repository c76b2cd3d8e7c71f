"""The shipped FMUs and their manifest: what each was built from, and whether it is still up to date.

``python -m thsa_cosim.export.manifest fmus/manifest.json`` rebuilds what is stale; ``--check`` only reports and exits
with 1 when something is stale. The manifest holds, for every archive, the Modelica class, the FMI version, the SHA-256
of the archive and the digest of its generated sources (C code and model description without dates), and the versions
of the tools that built it.
"""

import argparse
import hashlib
import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path

from thsa_cosim.errors import InputError
from thsa_cosim.export.archive import make_sources, write_fmu
from thsa_cosim.export.causal import make_causal
from thsa_cosim.export.flatten import flatten

TOOLS = ("casadi", "ziglang")


@dataclass(frozen=True)
class Entry:
    """One shipped FMU; ``file`` is relative to the manifest."""

    file: str
    model: str
    fmi: int
    source_digest: str = ""
    sha256: str = ""


def read_manifest(path: Path) -> tuple[Path, list[Entry]]:
    """The package folder and the entries of a manifest; raises InputError when it cannot be read."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return path.parent / content["package"], [Entry(**entry) for entry in content["fmus"]]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: is no FMU manifest ({error}); restore it from the repository.") from error


def stale(path: Path) -> dict[str, str]:
    """FMUs that do not match their manifest or their sources, with the reason."""
    package, entries = read_manifest(path)
    found = {}
    for entry in entries:
        archive = path.parent / entry.file
        if not archive.is_file():
            found[entry.file] = "the archive is missing"
        elif hashlib.sha256(archive.read_bytes()).hexdigest() != entry.sha256:
            found[entry.file] = "the archive is not the one that the manifest describes"
        elif (
            make_sources(make_causal(flatten(entry.model, package)), entry.fmi).digest != entry.source_digest
        ):
            found[entry.file] = "the Modelica model or the exporter has changed since it was built"
    return found


def rebuild(path: Path, *, everything: bool = False) -> list[str]:
    """Rebuild stale FMUs (or all) and rewrite the manifest; returns the files that were built."""
    package, entries = read_manifest(path)
    wanted = [entry.file for entry in entries] if everything else list(stale(path))
    fresh = []
    for entry in entries:
        if entry.file in wanted:
            model = make_causal(flatten(entry.model, package))
            archive = path.parent / entry.file
            sources = write_fmu(model, entry.fmi, archive, date=time.time())
            digest = hashlib.sha256(archive.read_bytes()).hexdigest()
            entry = Entry(entry.file, entry.model, entry.fmi, sources.digest, digest)
        fresh.append(entry)
    content = json.loads(path.read_text(encoding="utf-8"))
    content["fmus"] = [asdict(entry) for entry in fresh]
    if wanted:
        content["tools"] = {tool: metadata.version(tool) for tool in TOOLS}
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return wanted


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line of this module."""
    parser = argparse.ArgumentParser(description="Rebuild or check the shipped FMUs.")
    parser.add_argument("manifest", type=Path)
    parser.add_argument("--check", action="store_true", help="report stale FMUs and build nothing")
    parser.add_argument("--all", action="store_true", help="rebuild every FMU")
    options = parser.parse_args(arguments)
    if options.check:
        reasons = stale(options.manifest)
        for file, reason in reasons.items():
            print(f"{file}: {reason}")
        return 1 if reasons else 0
    for file in rebuild(options.manifest, everything=options.all):
        print(f"built {file}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
