"""Compiles the hand-written models with the C runtime and drives them through ctypes."""

from __future__ import annotations

import ctypes as ct
import functools
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace

import fmpy
import numpy as np
import pytest
from numpy.typing import NDArray

import thsa_cosim

HERE = Path(__file__).parent
RUNTIME = Path(thsa_cosim.__file__).parent / "export" / "runtime"
HEADERS = Path(fmpy.__file__).parent / "c-code"
COMMON = (
    "instance.c",
    "derivatives.c",
    "snapshot.c",
    "solver.c",
    "advance.c",
    "explain.c",
    "trajectory.c",
    "discrete.c",
    "newton.c",
)
OK, WARNING, DISCARD, ERROR = 0, 1, 2, 3

Array = NDArray[np.float64]


def compiler() -> list[str]:
    """The command of a C compiler, or a skip."""
    if shutil.which("gcc"):
        return ["gcc"]
    try:
        import ziglang  # noqa: F401
    except ImportError:
        pytest.skip("neither gcc nor ziglang is here to compile the runtime")
    return [sys.executable, "-m", "ziglang", "cc"]


def sizes(model: str) -> SimpleNamespace:
    """The N_ figures and the value references of a hand-written model."""
    n: dict[str, int] = {}
    for line in (HERE / model / "model_config.h").read_text().splitlines():
        parts = line.split()
        if len(parts) == 3 and parts[1].startswith("N_"):
            n[parts[1][2:].lower()] = int(parts[2])
    x = 1
    dx = x + n["x"]
    u = dx + n["x"]
    p = u + n["u"]
    d = p + n["p"]
    w = d + n["d"]
    g = w + n["w"]
    return SimpleNamespace(n=SimpleNamespace(**n), x=x, dx=dx, u=u, p=p, d=d, w=w, g=g, end=g + n["g"])


_folder = tempfile.TemporaryDirectory(prefix="thsa-runtime-", ignore_cleanup_errors=True)


@functools.cache
def build(model: str, fmi: int = 2, flags: tuple[str, ...] = ("-O2",), extra: tuple[str, ...] = ()) -> Path:
    """Compile one model into a shared library (or, with `extra` sources, a program)."""
    out = Path(_folder.name) / f"{model}_{fmi}_{abs(hash((flags, extra)))}.so"
    shared = [] if extra else ["-shared", "-fPIC", "-fvisibility=hidden"]
    sources = [
        *extra,
        *(RUNTIME / name for name in (f"fmi{fmi}.c", *COMMON)),
        HERE / model / "model.c",
        HERE / "guid.c",
    ]
    include = [f"-isystem{HEADERS}", *(f"-I{folder}" for folder in (HERE, HERE / model, RUNTIME))]
    warn = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"]
    command = [*compiler(), *warn, *flags, *shared, *include, "-o", out, *sources, "-lm", "-lpthread"]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return out


def doubles(values: Sequence[float] | Array) -> ct.Array[ct.c_double]:
    return (ct.c_double * len(values))(*values)


def refs(values: Sequence[int]) -> ct.Array[ct.c_uint]:
    return (ct.c_uint * len(values))(*values)


def ints(values: Sequence[int]) -> ct.Array[ct.c_int]:
    return (ct.c_int * len(values))(*values)


class Refused(Exception):
    """A call that did not return OK."""

    def __init__(self, function: str, status: int, log: list[tuple[int, str, str]]):
        super().__init__(f"{function} -> {status}: {log[-1:]}")
        self.status = status
