"""FMUs that come as C sources: build the library for this machine, on request."""

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from xml.etree import ElementTree

from thsa_cosim.errors import FmuError
from thsa_cosim.fmu.archive import unpack
from thsa_cosim.fmu.description import read_description
from thsa_cosim.fmu.native import LIBRARY_SUFFIX, platform_folders
from thsa_cosim.fmu.zig import one_at_a_time

_TIMEOUT_S = 600.0
_NO_PREFIX = ("-DFMI2_OVERRIDE_FUNCTION_PREFIX", "-DFMI3_OVERRIDE_FUNCTION_PREFIX", "-DDISABLE_PREFIX")
"""A shared library exports fmi2DoStep, sources may declare Model_fmi2DoStep (FMI 2.0.4 clause 2.1.1)."""


def compile_sources(path: Path, target: Path) -> Path:
    """Write ``path`` to ``target`` with libraries for this machine, built from the FMU's own C sources.

    Raises
    ------
    FmuError
        If it has no sources, there is no compiler, or they do not compile.
    """
    description = read_description(path)
    command = _compiler()
    with tempfile.TemporaryDirectory(prefix="thsa-cosim-sources-") as name:
        folder = Path(name)
        unpack(path, folder)
        sources = folder / "sources"
        if not sources.is_dir():
            raise FmuError(f"{path} holds no C sources; export it for {platform_folders('2.0')[0]}.")
        identifiers = {description.co_simulation_identifier, description.model_exchange_identifier} - {None}
        output = folder / "binaries" / platform_folders(description.fmi_version)[0]
        output.mkdir(parents=True, exist_ok=True)
        for identifier in sorted(identifiers, key=str):
            files = _files(folder, str(identifier))
            library = output / f"{identifier}{LIBRARY_SUFFIX}"
            _build(
                path,
                [
                    *command,
                    "-shared",
                    "-fPIC",
                    "-O2",
                    "-w",
                    *_NO_PREFIX,
                    *_definitions(folder),
                    *_includes(sources),
                ],
                [*files, "-o", str(library), "-lm"],
                sources,
            )
        target.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in sorted(folder.rglob("*")):
                if file.is_file():
                    archive.write(file, file.relative_to(folder).as_posix())
    return target


def _build(path: Path, options: list[str], files: list[str], folder: Path) -> None:
    command = [*options, *files]
    with one_at_a_time(command):
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False
        )
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if "error" in line] or done.stderr.splitlines()
        raise FmuError(
            f"The C sources of {path} do not compile: {' '.join(' '.join(lines[:2]).split())[:300]}."
        )


def host_compiler() -> str | None:
    """The machine's own C compiler: what CC names, cc, gcc or clang; None without one."""
    names = (os.environ.get("CC", ""), "cc", "gcc", "clang")
    return next((name for name in names if name and shutil.which(name)), None)


def has_compiler() -> bool:
    """Whether C can be compiled here, by the machine's compiler or the ziglang wheel's."""
    return host_compiler() is not None or importlib.util.find_spec("ziglang") is not None


def _compiler() -> list[str]:
    if own := host_compiler():
        return [own]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise FmuError("There is no C compiler here; install gcc or clang, or pip install ziglang.")


def _files(folder: Path, identifier: str) -> list[str]:
    """What the description (FMI 2.0) or the build description (FMI 3.0) lists, else every C file."""
    sources = folder / "sources"
    build = sources / "buildDescription.xml"
    tree = ElementTree.parse(build if build.is_file() else folder / "modelDescription.xml").getroot()
    if build.is_file():
        groups = [
            c for c in tree.iter("BuildConfiguration") if c.get("modelIdentifier") in (None, identifier)
        ]
    else:
        groups = [e for e in tree if e.get("modelIdentifier") == identifier]
    listed = [
        file.get("name", "")
        for group in groups
        for file in group.iter()
        if file.tag in ("File", "SourceFile")
    ]
    names = list(dict.fromkeys(listed)) or sorted(p.name for p in sources.glob("*.c"))
    return [name for name in names if name.endswith((".c", ".cc", ".cpp"))]


def _definitions(folder: Path) -> list[str]:
    build = folder / "sources" / "buildDescription.xml"
    if not build.is_file():
        return []
    found = ElementTree.parse(build).getroot().iter("PreprocessorDefinition")
    return [f"-D{d.get('name')}" + (f"={d.get('value')}" if d.get("value") else "") for d in found]


def _includes(sources: Path) -> list[str]:
    """Its own folders, and the FMI headers that fmpy ships."""
    fmpy = importlib.util.find_spec("fmpy")
    own = [sources, *(p for p in sources.rglob("*") if p.is_dir())]
    shipped = [Path(fmpy.origin).parent / "c-code"] if fmpy is not None and fmpy.origin is not None else []
    return [f"-I{folder}" for folder in (*own, *shipped)]
