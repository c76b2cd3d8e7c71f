"""C sources → shared libraries for every platform, by ``ziglang`` (a C compiler in a wheel).

Without that, gcc or clang of this machine builds for this machine.

What was compiled is kept by the digest of sources, flags, target and compiler, so that one study leaves it to the next.
"""

import contextlib
import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from platform import machine as machine_name

from thsa_cosim.errors import MissingExtraError, ThsaCosimError
from thsa_cosim.export.cache import cache_folder, keep
from thsa_cosim.fmu.sources import host_compiler
from thsa_cosim.fmu.zig import one_at_a_time


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


def native_platform() -> Platform:
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


#: Libraries that are kept; the oldest go first.
KEPT = 64


def compile_library(folder: Path, sources: Sequence[str], platform: Platform, output: Path) -> None:
    """Compile ``sources`` of ``folder`` to a shared library for ``platform``, unless it was compiled before.

    Raises MissingExtraError without a compiler for it and ThsaCosimError with the compiler's first line when it fails.
    """
    compiler, version = _compiler(platform)
    flags = [flag for flag in FLAGS if not (flag == "-fPIC" and platform.suffix == ".dll")]
    command = [*compiler, *flags, "-I.", *sources, "-o", str(output)]
    if platform.suffix == ".so":
        command.append("-lm")
    kept = _kept(folder, [version, platform.target, *flags, *sources], platform.suffix)
    if _was_kept(kept, output):
        return
    with one_at_a_time(command):
        if _was_kept(kept, output):  # compiled meanwhile
            return
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, env={**os.environ, "ZIG_PROGRESS": "0"}
        )
        if not done.returncode and kept is not None:
            keep(output, kept, KEPT)
    if done.returncode:
        lines = (
            [line for line in done.stderr.splitlines() if "error" in line]
            or done.stderr.splitlines()
            or ["no message"]
        )
        raise ThsaCosimError(f"The C compiler failed for {platform.target}: {lines[0]}")


def _was_kept(kept: Path | None, output: Path) -> bool:
    """Whether a kept library was copied to ``output``."""
    if kept is not None and kept.is_file():
        with contextlib.suppress(OSError):
            shutil.copyfile(kept, output)
            kept.touch()
            return True
    return False


def _kept(folder: Path, options: Sequence[str], suffix: str) -> Path | None:
    """Where the library of these files and options is kept; None where nothing can be kept."""
    digest = hashlib.sha256("\0".join(options).encode())
    for file in sorted(folder.glob("*.[ch]")):
        digest.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    cache = cache_folder("libraries")
    return cache / f"{digest.hexdigest()}{suffix}" if cache else None


def available_platforms() -> tuple[Platform, ...]:
    """What can be built for here: every platform with ziglang, else this machine."""
    return PLATFORMS if ziglang_version() else (native_platform(),)


def _compiler(platform: Platform) -> tuple[list[str], str]:
    """The command that compiles for ``platform``, and its version."""
    if version := ziglang_version():
        return [sys.executable, "-m", "ziglang", "cc", "-target", platform.target], version
    own = host_compiler() if platform == native_platform() and platform.suffix != ".dll" else None
    if own is None:
        raise MissingExtraError(f"Compiling an FMU for {platform.fmi3}", "export")
    return [own], _version(own)


def compiler_version() -> str | None:
    """Version of what compiles for this machine; None where nothing does."""
    try:
        return _compiler(native_platform())[1]
    except ThsaCosimError:
        return None


def ziglang_version() -> str | None:
    """Version of the ziglang wheel; None when it is not installed."""
    try:
        return metadata.version("ziglang")
    except metadata.PackageNotFoundError:
        return None


@cache
def _version(compiler: str) -> str:
    done = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=False)
    return done.stdout.partition("\n")[0]
