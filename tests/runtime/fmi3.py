"""An FMI 3.0 instance of a hand-written model, through ctypes; and a run with either version."""

from __future__ import annotations

import ctypes as ct
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from runtime.fmi2 import Fmi2
from runtime.harness import OK, Array, Refused, build, doubles, ints, refs, sizes

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
        early_return: bool = False,
        update: Callable[[Fmi3, float, bool, bool, bool], bool | None] | None = None,
        required: Sequence[int] = (),
        library: Path | None = None,
    ):
        self.refs = sizes(model)
        self.lib = ct.CDLL(str(library or build(model, 3)))
        self.log: list[tuple[int, str, str]] = []
        self._logger = LOGGER3(
            lambda _e, status, category, text: self.log.append((status, category.decode(), text.decode()))
        )

        def ask(
            _e: int,
            time: float,
            may_set: bool,
            may_get: bool,
            finished: bool,
            _may: bool,
            early: Any,
            _at: Any,
        ) -> None:
            if update and update(self, time, may_set, may_get, finished):
                early[0] = True

        self._update = UPDATE3(ask)
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
                *head, event_mode, early_return, refs(required), len(required), None, self._logger, hook
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

    def do_step(self, time: float, size: float) -> tuple[bool, float]:
        """Whether it returned early, and the time reached."""
        flags, reached = [ct.c_bool(True) for _ in range(3)], ct.c_double()
        self.call(
            "DoStep", ct.c_double(time), ct.c_double(size), True, *map(ct.byref, flags), ct.byref(reached)
        )
        assert not any(flag.value for flag in flags[:2])
        return flags[2].value, reached.value

    def step(self, time: float, size: float) -> float:
        early, reached = self.do_step(time, size)
        assert not early
        return reached

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
    for time, after in pairwise(times):
        if inputs:
            now, then = np.array(inputs(time)), np.array(inputs(after))
            fmu.set(u, now)
            if isinstance(fmu, Fmi2):
                fmu.slopes(u, (then - now) / (after - time))
        fmu.step(time, after - time)
        rows.append(fmu.get(vr))
    return np.array(rows)
