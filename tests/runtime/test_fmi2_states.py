"""Every FMI 2.0 function of exported FMUs in every state, with and without its pointers."""

from __future__ import annotations

import ctypes as ct
from collections.abc import Callable

import pytest

from runtime.fmi2 import EventInfo2, Fmi2
from runtime.harness import DISCARD, ERROR, OK, doubles, ints, refs, sizes

# Model "runaway": one state, one parameter (negative = cannot be initialised), fails beyond time 1.
R = sizes("runaway")
ONE = ct.c_size_t(1)


def enter(fmu: Fmi2, phase: str) -> None:
    """Bring a fresh instance of `runaway` into a phase of the state machines of FMI 2.0, 3.2.3 and 4.2.4."""
    if phase == "instantiated":
        return
    if phase == "error":
        fmu.set([R.p], [-1.0])
    fmu.setup()
    fmu.call("EnterInitializationMode")
    if phase == "initialization":
        return
    if phase == "error":
        assert fmu.raw("ExitInitializationMode") == ERROR
        return
    fmu.call("ExitInitializationMode")
    if phase == "continuous":
        fmu.call("EnterContinuousTimeMode")
    if phase == "failed":
        assert fmu.raw("DoStep", ct.c_double(0.0), ct.c_double(2.0), 1) == DISCARD
    if phase == "terminated":
        fmu.call("Terminate")


BOTH = {"instantiated", "initialization", "terminated", "error"}
CS, ME = {*BOTH, "step", "failed"}, {*BOTH, "event", "continuous"}
READ = {"initialization", "event", "continuous", "step", "failed", "terminated", "error"}
VECTOR = {"initialization", "event", "continuous", "terminated", "error"}
ANY = CS | ME


def out(n: int = 1) -> ct.Array[ct.c_double]:
    return (ct.c_double * n)()


def state_of(fmu: Fmi2) -> ct.c_void_p:
    return fmu.save()


# function -> (phases in which it is allowed, arguments)
TABLE: dict[str, tuple[set[str], Callable[[Fmi2], tuple[object, ...]]]] = {
    "SetDebugLogging": (ANY, lambda _f: (0, ct.c_size_t(0), None)),
    "SetupExperiment": ({"instantiated"}, lambda _f: (0, ct.c_double(0), ct.c_double(0), 0, ct.c_double(0))),
    "EnterInitializationMode": ({"instantiated"}, lambda _f: ()),
    "ExitInitializationMode": ({"initialization"}, lambda _f: ()),
    "Terminate": ({"event", "continuous", "step", "failed"}, lambda _f: ()),
    "Reset": (ANY, lambda _f: ()),
    "GetReal": (READ, lambda _f: (refs([0]), ONE, out())),
    "GetInteger": (READ, lambda _f: (None, ct.c_size_t(0), None)),
    "GetBoolean": (READ, lambda _f: (None, ct.c_size_t(0), None)),
    "GetString": (READ, lambda _f: (None, ct.c_size_t(0), None)),
    "SetReal": (
        {"instantiated", "initialization", "event", "continuous", "step"},
        lambda _f: (refs([]), ct.c_size_t(0), doubles([])),
    ),
    **{
        f"Set{kind}": (
            {"instantiated", "initialization", "event", "step"},
            lambda _f: (None, ct.c_size_t(0), None),
        )
        for kind in ("Integer", "Boolean", "String")
    },
    "GetFMUstate": (ANY, lambda _f: (ct.byref(ct.c_void_p()),)),
    "SetFMUstate": (ANY, lambda f: (state_of(f),)),
    "FreeFMUstate": (ANY, lambda f: (ct.byref(state_of(f)),)),
    "SerializedFMUstateSize": (ANY, lambda f: (state_of(f), ct.byref(ct.c_size_t()))),
    "SerializeFMUstate": (ANY, lambda f: (state_of(f), ct.create_string_buffer(10000), ct.c_size_t(10000))),
    "DeSerializeFMUstate": (
        ANY,
        lambda f: ((data := f.serialize(state_of(f))), ct.c_size_t(len(data)), ct.byref(ct.c_void_p())),
    ),
    "GetDirectionalDerivative": (
        READ - {"error"},
        lambda _f: (refs([R.w]), ONE, refs([R.x]), ONE, doubles([1.0]), out()),
    ),
    "EnterEventMode": ({"event", "continuous"}, lambda _f: ()),
    "NewDiscreteStates": ({"event"}, lambda _f: (ct.byref(EventInfo2()),)),
    "EnterContinuousTimeMode": ({"event"}, lambda _f: ()),
    "CompletedIntegratorStep": ({"continuous"}, lambda _f: (1, ct.byref(ct.c_int()), ct.byref(ct.c_int()))),
    "SetTime": ({"event", "continuous"}, lambda _f: (ct.c_double(0.5),)),
    "SetContinuousStates": ({"continuous"}, lambda _f: (doubles([0.0]), ONE)),
    "GetDerivatives": (VECTOR & ME, lambda _f: (out(), ONE)),
    "GetEventIndicators": (VECTOR & ME, lambda _f: (None, ct.c_size_t(0))),
    "GetContinuousStates": (VECTOR & ME, lambda _f: (out(), ONE)),
    "GetNominalsOfContinuousStates": (ME, lambda _f: (out(), ONE)),
    "SetRealInputDerivatives": (
        {"instantiated", "initialization", "step"},
        lambda _f: (None, ct.c_size_t(0), None, None),
    ),
    "GetRealOutputDerivatives": (
        {"step", "failed", "terminated"},
        lambda _f: (refs([R.w]), ONE, ints([1]), out()),
    ),
    "DoStep": ({"step"}, lambda _f: (ct.c_double(0.0), ct.c_double(0.1), 1)),
    "CancelStep": (set(), lambda _f: ()),
    "GetStatus": ({"step", "failed", "terminated"}, lambda _f: (0, ct.byref(ct.c_int()))),
    "GetRealStatus": ({"step", "failed", "terminated"}, lambda _f: (2, out())),
    "GetBooleanStatus": ({"step", "failed", "terminated"}, lambda _f: (3, ct.byref(ct.c_int()))),
    "GetStringStatus": ({"step", "failed", "terminated"}, lambda _f: (1, ct.byref(ct.c_char_p()))),
    "GetIntegerStatus": (set(), lambda _f: (0, ct.byref(ct.c_int()))),
}
CS_ONLY = {"SetRealInputDerivatives", "GetRealOutputDerivatives", "DoStep", "CancelStep"} | {
    name for name in TABLE if name.endswith("Status")
}
ME_ONLY = {
    *("EnterEventMode", "NewDiscreteStates", "EnterContinuousTimeMode", "CompletedIntegratorStep", "SetTime"),
    *("SetContinuousStates", "GetDerivatives", "GetEventIndicators", "GetContinuousStates"),
    "GetNominalsOfContinuousStates",
}
IN_ERROR_INCOMPUTABLE = {("error", "GetDerivatives")}  # allowed, but the point has no values


@pytest.mark.parametrize("kind", ["cs", "me"])
@pytest.mark.parametrize("function", sorted(TABLE))
def test_every_function_in_every_state(function: str, kind: str) -> None:
    """Allowed: it works. Forbidden: fmi2Error, a logged reason, and the instance is as it was."""
    phases, arguments = TABLE[function]
    for phase in sorted(CS if kind == "cs" else ME):
        with Fmi2("runaway", kind) as fmu:
            enter(fmu, phase)
            given = arguments(fmu)
            before, logged = fmu.serialize(fmu.save()), len(fmu.log)
            status = fmu.raw(function, *given)
            allowed = phase in phases and function not in (ME_ONLY if kind == "cs" else CS_ONLY)
            if allowed:
                if (phase, function) not in IN_ERROR_INCOMPUTABLE:
                    assert status == OK, (phase, fmu.log)
                continue
            if function == "GetIntegerStatus" and kind == "cs" and phase in {"step", "failed", "terminated"}:
                assert status == DISCARD  # allowed, but there is no such status
                continue
            assert status == ERROR, (phase, status)
            assert len(fmu.log) == logged + 1
            assert fmu.log[-1][0] == ERROR
            assert function in fmu.log[-1][2]
            assert fmu.serialize(fmu.save()) == before


@pytest.mark.parametrize("function", sorted(TABLE))
def test_null_instances_and_null_pointers_are_refused(function: str) -> None:
    phases, arguments = TABLE[function]
    kind = "me" if function in ME_ONLY else "cs"
    with Fmi2("runaway", kind) as fmu:
        enter(fmu, min(phases & (ME if kind == "me" else CS) - {"error"}, default="step"))
        given = arguments(fmu)
        # ctypes passes 0 for every pointer: the instance itself first, then each pointer argument
        assert getattr(fmu.lib, f"fmi2{function}")(None, *given) == ERROR
        for index, argument in enumerate(given):
            filled = isinstance(argument, ct.Array) and len(argument) > 0
            if filled or type(argument).__name__ == "CArgObject":
                bad = [None if i == index else a for i, a in enumerate(given)]
                status = fmu.raw(function, *bad)
                assert status == (OK if function == "FreeFMUstate" else ERROR), (function, index)
