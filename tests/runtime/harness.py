"""Compiles the hand-written models with the C runtime and drives them through ctypes."""

from __future__ import annotations

import ctypes as ct
import functools
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
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
COMMON = ("instance.c", "derivatives.c", "snapshot.c", "solver.c", "advance.c")
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
    sources = [*extra, *(RUNTIME / name for name in (f"fmi{fmi}.c", *COMMON)), HERE / model / "model.c"]
    include = [f"-I{folder}" for folder in (HEADERS, HERE, HERE / model, RUNTIME)]
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


LOGGER2 = ct.CFUNCTYPE(None, ct.c_void_p, ct.c_char_p, ct.c_int, ct.c_char_p, ct.c_char_p)
ALLOCATE = ct.CFUNCTYPE(ct.c_void_p, ct.c_size_t, ct.c_size_t)
FREE = ct.CFUNCTYPE(None, ct.c_void_p)
FINISHED = ct.CFUNCTYPE(None, ct.c_void_p, ct.c_int)


class Callbacks2(ct.Structure):
    _fields_ = (
        ("logger", LOGGER2),
        ("allocate", ALLOCATE),
        ("free", FREE),
        ("finished", FINISHED),
        ("environment", ct.c_void_p),
    )


class EventInfo2(ct.Structure):
    _fields_ = (
        ("again", ct.c_int),
        ("terminate", ct.c_int),
        ("nominals", ct.c_int),
        ("values", ct.c_int),
        ("time_event", ct.c_int),
        ("time", ct.c_double),
    )


class Fmi2:
    """One FMI 2.0 instance; every method is the FMI function, checked for OK unless called through `raw`."""

    def __init__(self, model: str, kind: str = "cs", *, logging: bool = False, library: Path | None = None):
        self.refs = sizes(model)
        self.lib = ct.CDLL(str(library or build(model, 2)))
        self.lib.fmi2Instantiate.restype = ct.c_void_p
        self.log: list[tuple[int, str, str]] = []
        self._logger = LOGGER2(
            lambda _e, _n, status, category, text: self.log.append((status, category.decode(), text.decode()))
        )
        self.callbacks = Callbacks2(logger=self._logger)
        self.component = self.lib.fmi2Instantiate(
            b"one", int(kind == "cs"), f"{{{model}}}".encode(), b"", ct.byref(self.callbacks), 0, int(logging)
        )
        assert self.component, self.log

    def raw(self, name: str, *arguments: object) -> int:
        function: Callable[..., int] = getattr(self.lib, f"fmi2{name}")
        return function(ct.c_void_p(self.component), *arguments)

    def call(self, name: str, *arguments: object) -> None:
        status = self.raw(name, *arguments)
        if status != OK:
            raise Refused(name, status, self.log)

    def setup(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> None:
        self.call(
            "SetupExperiment",
            int(tolerance is not None),
            ct.c_double(tolerance or 0.0),
            ct.c_double(start),
            int(stop is not None),
            ct.c_double(stop or 0.0),
        )

    def start(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> Fmi2:
        self.setup(start, stop, tolerance)
        self.call("EnterInitializationMode")
        self.call("ExitInitializationMode")
        return self

    def set(self, vr: Sequence[int], values: Sequence[float] | Array) -> None:
        self.call("SetReal", refs(vr), ct.c_size_t(len(vr)), doubles(values))

    def get(self, vr: Sequence[int]) -> Array:
        out = (ct.c_double * len(vr))()
        self.call("GetReal", refs(vr), ct.c_size_t(len(vr)), out)
        return np.array(out)

    def slopes(self, vr: Sequence[int], values: Sequence[float] | Array) -> None:
        self.call(
            "SetRealInputDerivatives", refs(vr), ct.c_size_t(len(vr)), ints([1] * len(vr)), doubles(values)
        )

    def output_slopes(self, vr: Sequence[int]) -> Array:
        out = (ct.c_double * len(vr))()
        self.call("GetRealOutputDerivatives", refs(vr), ct.c_size_t(len(vr)), ints([1] * len(vr)), out)
        return np.array(out)

    def step(self, time: float, size: float) -> None:
        self.call("DoStep", ct.c_double(time), ct.c_double(size), 1)

    def directional(self, unknown: Sequence[int], known: Sequence[int], seed: Sequence[float]) -> Array:
        out = (ct.c_double * len(unknown))()
        self.call(
            "GetDirectionalDerivative",
            refs(unknown),
            ct.c_size_t(len(unknown)),
            refs(known),
            ct.c_size_t(len(known)),
            doubles(seed),
            out,
        )
        return np.array(out)

    def save(self) -> ct.c_void_p:
        state = ct.c_void_p()
        self.call("GetFMUstate", ct.byref(state))
        return state

    def restore(self, state: ct.c_void_p) -> None:
        self.call("SetFMUstate", state)

    def discard(self, state: ct.c_void_p) -> None:
        self.call("FreeFMUstate", ct.byref(state))

    def serialize(self, state: ct.c_void_p) -> bytes:
        size = ct.c_size_t()
        self.call("SerializedFMUstateSize", state, ct.byref(size))
        data = ct.create_string_buffer(size.value)
        self.call("SerializeFMUstate", state, data, size)
        return data.raw

    def deserialize(self, data: bytes) -> ct.c_void_p:
        state = ct.c_void_p()
        self.call("DeSerializeFMUstate", data, ct.c_size_t(len(data)), ct.byref(state))
        return state

    def reset(self) -> None:
        self.call("Reset")

    def free(self) -> None:
        self.lib.fmi2FreeInstance(ct.c_void_p(self.component))
        self.component = None

    def events(self) -> int:
        return sum(category == "logEvents" for _status, category, _text in self.log)

    def __enter__(self) -> Fmi2:
        return self

    def __exit__(self, *_: object) -> None:
        if self.component:
            self.free()

    # Model Exchange

    def vector(self, name: str, n: int) -> Array:
        out = (ct.c_double * max(n, 1))()
        self.call(name, out, ct.c_size_t(n))
        return np.array(out)[:n]

    def set_states(self, x: Sequence[float] | Array) -> None:
        self.call("SetContinuousStates", doubles(x), ct.c_size_t(len(x)))

    def set_time(self, time: float) -> None:
        self.call("SetTime", ct.c_double(time))

    def update_events(self) -> None:
        self.call("NewDiscreteStates", ct.byref(EventInfo2()))


LOGGER3 = ct.CFUNCTYPE(None, ct.c_void_p, ct.c_int, ct.c_char_p, ct.c_char_p)
UPDATE3 = ct.CFUNCTYPE(
    None,
    ct.c_void_p,
    ct.c_double,
    ct.c_bool,
    ct.c_bool,
    ct.c_bool,
    ct.c_bool,
    ct.POINTER(ct.c_bool),
    ct.POINTER(ct.c_double),
)


class Fmi3:
    """One FMI 3.0 instance, in the manner of `Fmi2`."""

    def __init__(
        self,
        model: str,
        kind: str = "cs",
        *,
        logging: bool = False,
        event_mode: bool = False,
        update: Callable[[Fmi3, float, bool, bool, bool], None] | None = None,
        required: Sequence[int] = (),
        library: Path | None = None,
    ):
        self.refs = sizes(model)
        self.lib = ct.CDLL(str(library or build(model, 3)))
        self.log: list[tuple[int, str, str]] = []
        self._logger = LOGGER3(
            lambda _e, status, category, text: self.log.append((status, category.decode(), text.decode()))
        )
        self._update = UPDATE3(
            lambda _e, time, may_set, may_get, finished, _early, _asked, _at: (
                update and update(self, time, may_set, may_get, finished)
            )
        )
        head = (b"one", f"{{{model}}}".encode(), b"", False, logging)
        if kind == "cs":
            create = self.lib.fmi3InstantiateCoSimulation
            create.argtypes = (
                *(ct.c_char_p, ct.c_char_p, ct.c_char_p),
                *(ct.c_bool, ct.c_bool, ct.c_bool, ct.c_bool),
                *(ct.c_void_p, ct.c_size_t, ct.c_void_p, LOGGER3, UPDATE3),
            )
            create.restype = ct.c_void_p
            hook = self._update if update else UPDATE3()
            self.instance = create(
                *head, event_mode, False, refs(required), len(required), None, self._logger, hook
            )
        else:
            create = self.lib.fmi3InstantiateModelExchange
            create.argtypes = (
                *(ct.c_char_p, ct.c_char_p, ct.c_char_p),
                *(ct.c_bool, ct.c_bool, ct.c_void_p, LOGGER3),
            )
            create.restype = ct.c_void_p
            self.instance = create(*head, None, self._logger)
        assert self.instance, self.log

    def raw(self, name: str, *arguments: object) -> int:
        function: Callable[..., int] = getattr(self.lib, f"fmi3{name}")
        return function(ct.c_void_p(self.instance), *arguments)

    def call(self, name: str, *arguments: object) -> None:
        status = self.raw(name, *arguments)
        if status != OK:
            raise Refused(name, status, self.log)

    def enter(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> None:
        self.call(
            "EnterInitializationMode",
            ct.c_bool(tolerance is not None),
            ct.c_double(tolerance or 0.0),
            ct.c_double(start),
            ct.c_bool(stop is not None),
            ct.c_double(stop or 0.0),
        )

    def start(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> Fmi3:
        self.enter(start, stop, tolerance)
        self.call("ExitInitializationMode")
        return self

    def set(self, vr: Sequence[int], values: Sequence[float] | Array) -> None:
        n = ct.c_size_t(len(vr))
        self.call("SetFloat64", refs(vr), n, doubles(values), n)

    def get(self, vr: Sequence[int]) -> Array:
        out, n = (ct.c_double * len(vr))(), ct.c_size_t(len(vr))
        self.call("GetFloat64", refs(vr), n, out, n)
        return np.array(out)

    def step(self, time: float, size: float) -> float:
        flags, reached = [ct.c_bool(True) for _ in range(3)], ct.c_double()
        self.call(
            "DoStep", ct.c_double(time), ct.c_double(size), True, *map(ct.byref, flags), ct.byref(reached)
        )
        assert not any(flag.value for flag in flags)
        return reached.value

    def derivative(
        self, unknown: Sequence[int], known: Sequence[int], seed: Sequence[float], *, adjoint: bool = False
    ) -> Array:
        out = (ct.c_double * (len(known) if adjoint else len(unknown)))()
        self.call(
            "GetAdjointDerivative" if adjoint else "GetDirectionalDerivative",
            *(refs(unknown), ct.c_size_t(len(unknown)), refs(known), ct.c_size_t(len(known))),
            *(doubles(seed), ct.c_size_t(len(seed)), out, ct.c_size_t(len(out))),
        )
        return np.array(out)

    def output_slopes(self, vr: Sequence[int]) -> Array:
        out, n = (ct.c_double * len(vr))(), ct.c_size_t(len(vr))
        self.call("GetOutputDerivatives", refs(vr), n, ints([1] * len(vr)), out, n)
        return np.array(out)

    def save(self) -> ct.c_void_p:
        state = ct.c_void_p()
        self.call("GetFMUState", ct.byref(state))
        return state

    def restore(self, state: ct.c_void_p) -> None:
        self.call("SetFMUState", state)

    def discard(self, state: ct.c_void_p) -> None:
        self.call("FreeFMUState", ct.byref(state))

    def serialize(self, state: ct.c_void_p) -> bytes:
        size = ct.c_size_t()
        self.call("SerializedFMUStateSize", state, ct.byref(size))
        data = ct.create_string_buffer(size.value)
        self.call("SerializeFMUState", state, data, size)
        return data.raw

    def deserialize(self, data: bytes) -> ct.c_void_p:
        state = ct.c_void_p()
        self.call("DeserializeFMUState", data, ct.c_size_t(len(data)), ct.byref(state))
        return state

    def vector(self, name: str, n: int) -> Array:
        out = (ct.c_double * max(n, 1))()
        self.call(name, out, ct.c_size_t(n))
        return np.array(out)[:n]

    def set_states(self, x: Sequence[float] | Array) -> None:
        self.call("SetContinuousStates", doubles(x), ct.c_size_t(len(x)))

    def set_time(self, time: float) -> None:
        self.call("SetTime", ct.c_double(time))

    def update_events(self) -> None:
        flags, time = [ct.c_bool(True) for _ in range(5)], ct.c_double()
        self.call("UpdateDiscreteStates", *map(ct.byref, flags), ct.byref(time))
        assert not any(flag.value for flag in flags)

    def reset(self) -> None:
        self.call("Reset")

    def free(self) -> None:
        self.lib.fmi3FreeInstance(ct.c_void_p(self.instance))
        self.instance = None

    def events(self) -> int:
        return sum(category == "logEvents" for _status, category, _text in self.log)

    def __enter__(self) -> Fmi3:
        return self

    def __exit__(self, *_: object) -> None:
        if self.instance:
            self.free()


def run(
    fmu: Fmi2 | Fmi3,
    times: Array,
    vr: Sequence[int],
    inputs: Callable[[float], Sequence[float] | Array] | None = None,
) -> Array:
    """Step through `times`, with FMI 2 with piecewise-linear inputs; one row of the variables `vr` per time."""
    u = list(range(fmu.refs.u, fmu.refs.u + fmu.refs.n.u))
    rows = [fmu.get(vr)]
    for time, after in zip(times[:-1], times[1:], strict=True):
        if inputs:
            now, then = np.array(inputs(time)), np.array(inputs(after))
            fmu.set(u, now)
            if isinstance(fmu, Fmi2):
                fmu.slopes(u, (then - now) / (after - time))
        fmu.step(time, after - time)
        rows.append(fmu.get(vr))
    return np.array(rows)
