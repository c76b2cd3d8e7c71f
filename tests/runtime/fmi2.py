"""An FMI 2.0 instance of a hand-written model, through ctypes."""

from __future__ import annotations

import ctypes as ct
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from runtime.harness import OK, Array, Refused, build, doubles, ints, refs, sizes

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
