"""The FMI 3.0 layer of exported FMUs: state machine, intermediate update, Event Mode, adjoint derivatives."""

from __future__ import annotations

import ctypes as ct
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
import pytest

from runtime.fmi2 import Fmi2
from runtime.fmi3 import Fmi3, run
from runtime.harness import DISCARD, ERROR, OK, Array, Refused, doubles, ints, refs, sizes
from runtime.test_solver import KNOTS, linear_exact, piecewise

R = sizes("runaway")  # negative parameter: cannot be initialised; fails beyond time 1
ONE, NONE = ct.c_size_t(1), ct.c_size_t(0)


def enter(fmu: Fmi3, phase: str) -> None:
    """Bring a fresh instance of `runaway` into a state of FMI 3.0, 2.3, 3.2 and 4.2."""
    if phase == "instantiated":
        return
    if phase == "error":
        fmu.set([R.p], [-1.0])
    fmu.enter()
    if phase == "initialization":
        return
    if phase == "error":
        assert fmu.raw("ExitInitializationMode") == ERROR
        return
    fmu.call("ExitInitializationMode")
    if phase == "continuous":
        fmu.call("EnterContinuousTimeMode")
    if phase == "step":
        fmu.call("EnterStepMode")
    if phase == "terminated":
        fmu.call("Terminate")


CS = {"instantiated", "initialization", "event", "step", "terminated", "error"}
ME = {"instantiated", "initialization", "event", "continuous", "terminated", "error"}
ANY = CS | ME
SET = {"instantiated", "initialization", "event", "step"}
VECTOR = {"initialization", "event", "continuous", "terminated"}


def out(n: int = 1) -> ct.Array[ct.c_double]:
    return (ct.c_double * n)()


def flag() -> object:
    return ct.byref(ct.c_bool())


def pointers(count: int) -> tuple[object, ...]:
    return (None, NONE, *([None] * count))


Arguments = Callable[[Fmi3], tuple[object, ...]]
TABLE: dict[str, tuple[set[str], Arguments]] = {
    "SetDebugLogging": (ANY, lambda _f: (False, NONE, None)),
    "EnterInitializationMode": (
        {"instantiated"},
        lambda _f: (False, ct.c_double(0), ct.c_double(0), False, ct.c_double(0)),
    ),
    "ExitInitializationMode": ({"initialization"}, lambda _f: ()),
    "EnterEventMode": ({"continuous", "step"}, lambda _f: ()),
    "Terminate": ({"event", "continuous", "step"}, lambda _f: ()),
    "Reset": (ANY, lambda _f: ()),
    "GetFloat64": (ANY, lambda _f: (refs([0]), ONE, out(), ONE)),
    "SetFloat64": (SET | {"continuous"}, lambda _f: (None, NONE, None, NONE)),
    **{
        f"Get{kind}": (ANY, lambda _f: (None, NONE, None, NONE))
        for kind in ("Float32", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")
    },
    **{
        f"Set{kind}": (SET, lambda _f: (None, NONE, None, NONE))
        for kind in ("Float32", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")
    },
    **{f"Get{kind}": (ANY, lambda _f: (None, NONE, None, NONE)) for kind in ("Boolean", "String")},
    **{f"Set{kind}": (SET, lambda _f: (None, NONE, None, NONE)) for kind in ("Boolean", "String")},
    "GetBinary": (ANY, lambda _f: (None, NONE, None, None, NONE)),
    "SetBinary": (SET, lambda _f: (None, NONE, None, None, NONE)),
    "GetClock": (ANY, lambda _f: (None, NONE, None)),
    "SetClock": (SET, lambda _f: (None, NONE, None)),
    "GetNumberOfVariableDependencies": (set(), lambda _f: (ct.c_uint(R.w), ct.byref(ct.c_size_t()))),
    "GetVariableDependencies": (set(), lambda _f: (ct.c_uint(R.w), None, None, None, None, NONE)),
    "GetFMUState": (ANY, lambda _f: (ct.byref(ct.c_void_p()),)),
    "SetFMUState": (ANY, lambda f: (f.save(),)),
    "FreeFMUState": (ANY, lambda f: (ct.byref(f.save()),)),
    "SerializedFMUStateSize": (ANY, lambda f: (f.save(), ct.byref(ct.c_size_t()))),
    "SerializeFMUState": (ANY, lambda f: (f.save(), ct.create_string_buffer(10000), ct.c_size_t(10000))),
    "DeserializeFMUState": (
        ANY,
        lambda f: ((data := f.serialize(f.save())), ct.c_size_t(len(data)), ct.byref(ct.c_void_p())),
    ),
    "GetDirectionalDerivative": (
        ANY - {"instantiated", "error"},
        lambda _f: (refs([R.w]), ONE, refs([R.x]), ONE, doubles([1.0]), ONE, out(), ONE),
    ),
    "GetAdjointDerivative": (
        ANY - {"instantiated", "error"},
        lambda _f: (refs([R.w]), ONE, refs([R.x]), ONE, doubles([1.0]), ONE, out(), ONE),
    ),
    "EnterConfigurationMode": (set(), lambda _f: ()),
    "ExitConfigurationMode": (set(), lambda _f: ()),
    "GetIntervalDecimal": (set(), lambda _f: pointers(2)),
    "GetIntervalFraction": (set(), lambda _f: pointers(3)),
    "GetShiftDecimal": (set(), lambda _f: pointers(1)),
    "GetShiftFraction": (set(), lambda _f: pointers(2)),
    "SetIntervalDecimal": (set(), lambda _f: pointers(1)),
    "SetIntervalFraction": (set(), lambda _f: pointers(2)),
    "SetShiftDecimal": (set(), lambda _f: pointers(1)),
    "SetShiftFraction": (set(), lambda _f: pointers(2)),
    "EvaluateDiscreteStates": ({"initialization", "event"}, lambda _f: ()),
    "UpdateDiscreteStates": ({"event"}, lambda _f: (*(flag() for _ in range(5)), out())),
    "EnterContinuousTimeMode": ({"event"}, lambda _f: ()),
    "CompletedIntegratorStep": ({"continuous"}, lambda _f: (True, flag(), flag())),
    "SetTime": ({"event", "continuous"}, lambda _f: (ct.c_double(0.5),)),
    "SetContinuousStates": ({"continuous"}, lambda _f: (doubles([0.0]), ONE)),
    "GetContinuousStateDerivatives": (VECTOR, lambda _f: (out(), ONE)),
    "GetEventIndicators": (VECTOR, lambda _f: (None, NONE)),
    "GetContinuousStates": (VECTOR, lambda _f: (out(), ONE)),
    "GetNominalsOfContinuousStates": (VECTOR, lambda _f: (out(), ONE)),
    "GetNumberOfEventIndicators": (ANY, lambda _f: (ct.byref(ct.c_size_t()),)),
    "GetNumberOfContinuousStates": (ANY, lambda _f: (ct.byref(ct.c_size_t()),)),
    "EnterStepMode": ({"event"}, lambda _f: ()),
    "GetOutputDerivatives": ({"step", "terminated"}, lambda _f: (refs([R.w]), ONE, ints([1]), out(), ONE)),
    "DoStep": (
        {"step"},
        lambda _f: (ct.c_double(0.0), ct.c_double(0.1), True, flag(), flag(), flag(), out()),
    ),
    "ActivateModelPartition": (set(), lambda _f: (ct.c_uint(0), ct.c_double(0.0))),
}
CS_ONLY = {"EnterStepMode", "GetOutputDerivatives", "DoStep"}
ME_ONLY = {
    *("EnterContinuousTimeMode", "CompletedIntegratorStep", "SetTime", "SetContinuousStates"),
    *("GetContinuousStateDerivatives", "GetEventIndicators", "GetContinuousStates"),
    *("GetNominalsOfContinuousStates", "GetNumberOfEventIndicators", "GetNumberOfContinuousStates"),
}


@pytest.mark.parametrize("kind", ["cs", "me"])
@pytest.mark.parametrize("function", sorted(TABLE))
def test_every_function_in_every_state(function: str, kind: str) -> None:
    """Allowed: it works. Forbidden: fmi3Error, a logged reason, and the instance is as it was."""
    phases, arguments = TABLE[function]
    for phase in sorted(CS if kind == "cs" else ME):
        with Fmi3("runaway", kind, event_mode=True) as fmu:
            enter(fmu, phase)
            given = arguments(fmu)
            before, logged = fmu.serialize(fmu.save()), len(fmu.log)
            status = fmu.raw(function, *given)
            if phase in phases and function not in (ME_ONLY if kind == "cs" else CS_ONLY):
                assert status == OK, (phase, fmu.log)
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
    with Fmi3("runaway", kind, event_mode=True) as fmu:
        enter(fmu, min(phases & (ME if kind == "me" else CS) - {"error"}, default="step"))
        given = arguments(fmu)
        assert getattr(fmu.lib, f"fmi3{function}")(None, *given) == ERROR
        for index, argument in enumerate(given):
            filled = isinstance(argument, ct.Array) and len(argument) > 0
            if filled or type(argument).__name__ == "CArgObject":
                bad = [None if i == index else a for i, a in enumerate(given)]
                status = fmu.raw(function, *bad)
                assert status == (OK if function == "FreeFMUState" else ERROR), (function, index)


def test_constructors_refuse_what_they_must() -> None:
    with Fmi3("runaway") as fmu:
        create, log = fmu.lib.fmi3InstantiateCoSimulation, fmu._logger
        rest = (b"", False, False, False, False, refs([]), 0, None, log, type(fmu._update)())
        assert create(b"a", b"{other}", *rest) is None
        assert "token" in fmu.log[-1][2]
        assert create(b"", b"{runaway}", *rest) is None
        assert create(None, b"{runaway}", *rest) is None
        assert create(b"a", None, *rest) is None
        scheduled = fmu.lib.fmi3InstantiateScheduledExecution
        scheduled.restype = ct.c_void_p
        assert scheduled(b"a", b"{runaway}", None, 0, 0, None, log, None, None, None) is None
        assert "Scheduled" in fmu.log[-1][2]
        fmu.lib.fmi3FreeInstance(None)
        fmu.lib.fmi3GetVersion.restype = ct.c_char_p
        assert fmu.lib.fmi3GetVersion() == b"3.0"


def test_sizes_and_types_are_checked() -> None:
    with Fmi3("linear") as fmu:
        fmu.start()
        assert fmu.raw("GetFloat64", refs([0]), ONE, out(2), ct.c_size_t(2)) == ERROR
        assert fmu.raw("SetFloat64", refs([fmu.refs.u]), ONE, out(2), ct.c_size_t(2)) == ERROR
        assert fmu.raw("GetFloat64", refs([fmu.refs.end]), ONE, out(), ONE) == ERROR
        assert fmu.raw("GetInt32", refs([0]), ONE, (ct.c_int * 1)(), ONE) == ERROR
        two = ct.c_size_t(2)
        arguments = (refs([fmu.refs.w]), ONE, refs([fmu.refs.x]), ONE, doubles([1.0, 2.0]), two, out(), ONE)
        assert fmu.raw("GetDirectionalDerivative", *arguments) == ERROR
        assert fmu.raw("EnterEventMode") == ERROR  # created with eventModeUsed = false


def test_start_values_can_be_read_when_instantiated() -> None:
    with Fmi3("linear") as fmu:
        r = fmu.refs
        np.testing.assert_array_equal(fmu.get([r.x, r.u, r.p + 1, r.d]), [1.0, 0.0, 2.0, 1.0])
        assert fmu.raw("GetFloat64", refs([r.w]), ONE, out(), ONE) == ERROR


def drive(fmu: Fmi3 | Fmi2, begin: int = 0, end: int = 50) -> Array:
    r = fmu.refs
    times = np.arange(begin, end + 1) * 0.01
    rows = []
    for time, after in pairwise(times):
        fmu.set([r.u, r.u + 1], [2.0 * np.cos(20.0 * time), 0.3])
        fmu.step(time, after - time)
        rows.append(fmu.get([0, r.x, r.x + 1, r.x + 2, r.w + 2]))
    return np.array(rows)


def test_both_versions_of_fmi_give_the_same_numbers() -> None:
    with Fmi3("stickslip") as three, Fmi2("stickslip") as two:
        np.testing.assert_array_equal(drive(three.start()), drive(two.start()))


def test_reset_and_saved_states_are_bit_identical() -> None:
    with Fmi3("stickslip", event_mode=True) as fmu, Fmi3("stickslip") as other:
        fmu.start().call("EnterStepMode")
        expected = drive(fmu, 0, 20)
        saved = fmu.save()
        data = fmu.serialize(saved)
        later = drive(fmu, 20, 50)
        fmu.restore(saved)
        np.testing.assert_array_equal(drive(fmu, 20, 50), later)
        other.restore(other.deserialize(data))
        np.testing.assert_array_equal(drive(other, 20, 50), later)
        fmu.reset()
        fmu.start().call("EnterStepMode")  # still an instance with Event Mode
        np.testing.assert_array_equal(drive(fmu, 0, 20), expected)
        damaged = data[:50] + bytes([data[50] ^ 4]) + data[51:]
        with pytest.raises(Refused):
            fmu.deserialize(damaged)
        fmu.discard(saved)


@pytest.mark.parametrize("pieces", [4, 12, 24])
def test_inputs_by_intermediate_update_are_exact_when_piecewise_linear(pieces: int) -> None:
    """Asked for at the end of each internal step; with kinks at communication points nothing is held."""

    def update(fmu: Fmi3, time: float, may_set: bool, may_get: bool, finished: bool) -> None:
        if may_set:
            assert not may_get
            fmu.set([fmu.refs.u, fmu.refs.u + 1], piecewise(time))
            assert fmu.raw("GetFloat64", refs([fmu.refs.w]), ONE, out(), ONE) == ERROR
            assert fmu.raw("DoStep", *TABLE["DoStep"][1](fmu)) == ERROR
        else:
            assert finished
            seen.append((time, *fmu.get([0, fmu.refs.w])))
            assert fmu.raw("SetFloat64", refs([fmu.refs.u]), ONE, doubles([0.0]), ONE) == ERROR

    seen: list[tuple[float, ...]] = []
    times = np.linspace(0.0, 3.0, pieces + 1)
    exact = linear_exact(times, piecewise, KNOTS)
    r = sizes("linear")
    with Fmi3("linear", update=update, required=[r.u, r.u + 1, r.w]) as fmu:
        states = [r.x, r.x + 1, r.x + 2]
        found = run(fmu.start(tolerance=1e-8), times, states, piecewise)
    aligned = pieces % 12 == 0  # otherwise kinks fall inside internal steps: second order there
    bound = 3e-8 if aligned else 3e-2
    assert np.all(np.abs(found - exact).max(axis=0) < bound * np.abs(exact).max(axis=0))
    assert len(seen) >= pieces
    assert all(time == now for time, now, _ in seen)


def test_without_required_variables_the_importer_is_not_asked() -> None:
    calls: list[float] = []
    with Fmi3("linear", update=lambda _f, time, *_: calls.append(time)) as fmu:
        fmu.start().step(0.0, 1.0)
    assert calls == []


def test_event_mode_takes_jumps_of_inputs() -> None:
    with Fmi3("saturation", event_mode=True) as fmu, Fmi3("saturation") as plain:
        r = fmu.refs
        fmu.start()
        plain.start()
        fmu.set([r.u], [0.1])
        fmu.update_events()
        fmu.call("EnterStepMode")
        plain.set([r.u], [0.1])
        for part, set_point in enumerate([0.1, 3.0, -3.0]):
            if part:
                fmu.call("EnterEventMode")
                fmu.set([r.u], [set_point])
                fmu.update_events()
                assert fmu.get([r.w + 1])[0] == np.sign(set_point)  # saturates at once
                fmu.call("EnterStepMode")
                plain.set([r.u], [set_point])
            fmu.step(0.1 * part, 0.1)
            plain.step(0.1 * part, 0.1)
            np.testing.assert_array_equal(fmu.get([r.x, r.x + 1]), plain.get([r.x, r.x + 1]))


def test_a_discarded_step_leaves_the_instance_where_it_was() -> None:
    with Fmi3("runaway") as fmu:
        fmu.start()
        fmu.step(0.0, 0.5)
        reached = ct.c_double()
        flags = [flag() for _ in range(3)]
        status = fmu.raw("DoStep", ct.c_double(0.5), ct.c_double(1.0), True, *flags, ct.byref(reached))
        assert (status, reached.value) == (DISCARD, 0.5)
        assert fmu.log[-1][1] == "logStatusDiscard"
        assert fmu.step(0.5, 0.25) == 0.75


@pytest.mark.parametrize("model", ["oscillator", "stickslip", "linear", "bench"])
def test_adjoint_is_the_transpose_of_the_directional_derivative(model: str) -> None:
    with Fmi3(model) as fmu:
        r = fmu.refs
        fmu.start()
        known = [*range(r.x, r.x + r.n.x), *range(r.u, r.u + r.n.u), *range(r.p, r.p + r.n.p)]
        unknown = [*range(r.dx, r.dx + r.n.x), *range(r.w, r.w + r.n.w)]
        jacobian = np.array([fmu.derivative(unknown, [vr], [1.0]) for vr in known]).T
        seed = np.linspace(-1.0, 2.0, len(unknown))
        np.testing.assert_allclose(
            fmu.derivative(unknown, known, seed, adjoint=True), seed @ jacobian, rtol=1e-13
        )


def test_output_derivatives_and_indicators() -> None:
    with Fmi3("oscillator") as fmu:
        r = fmu.refs
        fmu.start().step(0.0, 0.4)
        x = fmu.get([r.x, r.x + 1])
        np.testing.assert_allclose(fmu.output_slopes([r.w, r.w + 1]), [x[1], 0.0], atol=1e-12)
    with Fmi3("stickslip", "me") as fmu:
        r = fmu.refs
        count = ct.c_size_t()
        fmu.start().call("GetNumberOfEventIndicators", ct.byref(count))
        assert count.value == 2
        fmu.call("GetNumberOfContinuousStates", ct.byref(count))
        assert count.value == 3
        fmu.update_events()
        fmu.call("EnterContinuousTimeMode")
        fmu.set_states([0.0, 0.3, 0.0])
        g = fmu.vector("GetEventIndicators", 2)
        np.testing.assert_allclose(g, [0.3, -0.3], rtol=1e-5)
        np.testing.assert_array_equal(fmu.get([r.g, r.g + 1]), g)
        wanted, terminate = ct.c_bool(), ct.c_bool()
        fmu.call("CompletedIntegratorStep", True, ct.byref(wanted), ct.byref(terminate))
        assert wanted.value


def test_instances_in_threads_equal_serial_runs() -> None:
    def one(seed: int) -> Array:
        with Fmi3("stickslip") as fmu:
            fmu.set([fmu.refs.p + 2], [1.0 + 0.01 * seed])
            return drive(fmu.start())

    serial = [one(seed) for seed in range(4)]
    with ThreadPoolExecutor(4) as pool:
        for found, expected in zip(pool.map(one, range(4)), serial, strict=True):
            np.testing.assert_array_equal(found, expected)
