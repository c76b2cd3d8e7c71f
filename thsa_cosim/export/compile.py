"""C sources → shared libraries for every platform, by ``ziglang`` (a C compiler in a wheel)."""

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from platform import machine as machine_name

from thsa_cosim.errors import MissingExtraError, ThsaCosimError


@dataclass(frozen=True)
class Platform:
    """A platform: its folder in FMI 2.0 (2.2.1 of FMI 2.0.4) and FMI 3.0 (2.5.1.4.1), and zig's target."""

    fmi2: str | None
    fmi3: str
    target: str
    suffix: str


PLATFORMS = (
    Platform("linux64", "x86_64-linux", "x86_64-linux-gnu.2.17", ".so"),
    Platform("win64", "x86_64-windows", "x86_64-windows-gnu", ".dll"),
    Platform("darwin64", "x86_64-darwin", "x86_64-macos", ".dylib"),
    Platform(None, "aarch64-darwin", "aarch64-macos", ".dylib"),
    Platform(None, "aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
)


def this_platform() -> Platform:
    """The platform that this process runs on; ThsaCosimError if nothing can be built for it."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine_name().lower(), machine_name().lower())
    system = {"linux": "linux", "darwin": "darwin", "win32": "windows"}.get(sys.platform, sys.platform)
    for platform in PLATFORMS:
        if platform.fmi3 == f"{machine}-{system}":
            return platform
    raise ThsaCosimError(f"FMUs cannot be built for {machine}-{system}.")


FLAGS = (
    "-std=c99",
    "-O2",
    "-s",
    "-shared",
    "-fPIC",
    "-fvisibility=hidden",
    "-ffp-contract=off",
    "-fno-math-errno",
)


def compile_library(folder: Path, sources: Sequence[str], platform: Platform, output: Path) -> None:
    """Compile ``sources`` of ``folder`` to a shared library for ``platform``.

    Raises MissingExtraError without ziglang and ThsaCosimError with the compiler's first line when it fails.
    """
    compiler_version()
    flags = [flag for flag in FLAGS if not (flag == "-fPIC" and platform.suffix == ".dll")]
    command = [
        sys.executable,
        "-m",
        "ziglang",
        "cc",
        "-target",
        platform.target,
        *flags,
        "-I.",
        *sources,
        "-o",
        str(output),
    ]
    if platform.suffix == ".so":
        command.append("-lm")
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, env={**os.environ, "ZIG_PROGRESS": "0"}
    )
    if done.returncode:
        lines = (
            [line for line in done.stderr.splitlines() if "error" in line]
            or done.stderr.splitlines()
            or ["no message"]
        )
        raise ThsaCosimError(f"The C compiler failed for {platform.target}: {lines[0]}")


def compiler_version() -> str:
    """Version of the ziglang wheel; raises MissingExtraError when it is not installed."""
    try:
        return metadata.version("ziglang")
    except metadata.PackageNotFoundError as error:
        raise MissingExtraError("Compiling an FMU", "export") from error
