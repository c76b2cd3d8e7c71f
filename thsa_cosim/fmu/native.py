"""An FMU's shared library: loading, calling, and the callbacks that it is given."""

import contextlib
import ctypes
import os
import sys
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.failure import SimulationFailure, Status

MessageSink = Callable[[str], None]

_STATUS_NAMES = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")
_STATUS_OF_CODE = {2: Status.FMI_DISCARD, 4: Status.FMI_FATAL}


LIBRARY_SUFFIX = {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")
"""Ending of shared libraries here."""


def platform_folders(fmi_version: str) -> tuple[str, ...]:
    """Folders under ``binaries/`` that fit this machine (FMI 1 and 2: linux64; FMI 3: x86_64-linux)."""
    machine = os.uname().machine if hasattr(os, "uname") else "x86_64"
    architecture = {"AMD64": "x86_64", "arm64": "aarch64"}.get(machine, machine)
    system = {"darwin": "darwin", "win32": "windows"}.get(sys.platform, "linux")
    old = {"linux": "linux", "darwin": "darwin", "windows": "win"}[system] + "64"
    tuple_name = f"{architecture}-{system}"
    return (tuple_name,) if fmi_version == "3.0" else (old, tuple_name)


def library_path(folder: Path, description: FmuDescription, identifier: str) -> Path:
    """Return the shared library for this machine; SimulationFailure names what the archive has instead."""
    extension = LIBRARY_SUFFIX
    folders = platform_folders(description.fmi_version)
    for name in folders:
        candidate = folder / "binaries" / name / (identifier + extension)
        if candidate in _loaded or candidate.is_file():
            return candidate
    has = ", ".join(description.platforms) or "none"
    raise SimulationFailure(
        Status.LOAD_ERROR,
        f"{description.path.name} has no library {identifier}{extension} for {folders[0]} (it has: {has})",
    )


class Library:
    """A loaded shared library; stays loaded until the process ends.

    Some exporters leak a thread key per load and die near the thousandth, so nothing is unloaded.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._dll = _loaded_with_neighbours(path)
        except OSError as error:
            missing = " (install that library)" if "cannot open shared object file" in str(error) else ""
            reason = f"{path.name} cannot be loaded: {error}{missing}"
            raise SimulationFailure(Status.LOAD_ERROR, reason) from None
        self._name = path.name
        self._functions: dict[str, Any] = {}

    def function(self, name: str, *argtypes: Any, restype: Any = ctypes.c_int) -> Any:
        """Return the C function ``name`` with its prototype; SimulationFailure if it is not exported."""
        known = self._functions.get(name)
        if known is not None:
            return known
        try:
            function = self._dll[name]
        except AttributeError:
            reason = f"{self._name} does not export the function {name}"
            raise SimulationFailure(Status.LOAD_ERROR, reason) from None
        function.argtypes, function.restype = argtypes, restype
        self._functions[name] = function
        return function

    def exports(self, name: str) -> bool:
        """Whether the library has the C function ``name``."""
        return hasattr(self._dll, name)

    @staticmethod
    def address(function: Any) -> int:
        """Return a function's (or callback's) address as an integer."""
        return ctypes.cast(function, ctypes.c_void_p).value or 0


def _loaded_with_neighbours(path: Path) -> ctypes.CDLL:
    """Load a library; if one that it needs is not found, load those next to it in the archive first."""
    try:
        return ctypes.CDLL(str(path))
    except OSError:
        beside = [p for p in sorted(path.parent.iterdir()) if p != path and LIBRARY_SUFFIX in p.name]
        for _ in beside:  # they may need each other: a round settles one at least
            for library in list(beside):
                with contextlib.suppress(OSError):
                    ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
                    beside.remove(library)
        return ctypes.CDLL(str(path))


_loaded: dict[Path, Library] = {}


def load_library(path: Path) -> Library:
    """Load a shared library once per process."""
    if path not in _loaded:
        _loaded[path] = Library(path)
    return _loaded[path]


class Messages:
    """What an FMU logged: the last few messages, each also handed to ``sink``."""

    def __init__(self, sink: MessageSink | None = None) -> None:
        self._recent: deque[str] = deque(maxlen=8)
        self._sink = sink

    def add(self, status: int, category: bytes | None, message: bytes | None) -> None:
        """Take one log message with its FMI status code."""
        text = " ".join((message or b"").decode("utf-8", "replace").split())[:500]
        if status > 0 and text:
            self._recent.append(text)
        if self._sink is not None:
            level = _STATUS_NAMES[status] if 0 <= status < len(_STATUS_NAMES) else str(status)
            self._sink(f"[{level}] {(category or b'').decode('utf-8', 'replace')}: {text}\n")

    def clear(self) -> None:
        """Forget the messages of the previous run."""
        self._recent.clear()

    def last(self) -> str:
        """Return ``": message"`` for the last warning or error, or an empty string."""
        return f": {self._recent[-1]}" if self._recent else ""


def status_name(prefix: str, code: int) -> str:
    """Name an FMI status code, e.g. ``fmi2Discard``."""
    return (
        f"{prefix}{_STATUS_NAMES[code]}" if 0 <= code < len(_STATUS_NAMES) else f"the illegal status {code}"
    )


def failure(
    prefix: str, function: str, code: int, messages: Messages, time: float | None
) -> SimulationFailure:
    """Return what an FMI function's status code ``code`` (2 or more) means."""
    at = "" if time is None else f" at t = {time:.9g} s"
    reason = f"{prefix}{function} returned {status_name(prefix, code)}{at}{messages.last()}"
    return SimulationFailure(_STATUS_OF_CODE.get(code, Status.FMI_ERROR), reason)
