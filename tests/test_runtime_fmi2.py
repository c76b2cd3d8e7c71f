"""The FMI 2.0 layer of exported FMUs: state machine, value references, saved states, Model Exchange."""

from __future__ import annotations

import ctypes as ct
import gc
import resource
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from runtime.harness import (
    DISCARD,
    ERROR,
    OK,
    Array,
    EventInfo2,
    Fmi2,
    Refused,
    doubles,
    ints,
    refs,
    run,
    sizes,
)
from scipy.integrate import solve_ivp

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
            if isinstance(argument, ct.Array) and len(argument) or type(argument).__name__ == "CArgObject":
                bad = [None if i == index else a for i, a in enumerate(given)]
                status = fmu.raw(function, *bad)
                assert status == (OK if function == "FreeFMUstate" else ERROR), (function, index)


def test_constructor_refuses_what_it_must() -> None:
    with Fmi2("runaway") as fmu:
        create, callbacks = fmu.lib.fmi2Instantiate, ct.byref(fmu.callbacks)
        assert create(b"a", 1, b"{other}", b"", callbacks, 0, 0) is None
        assert "GUID" in fmu.log[-1][2]
        assert create(b"", 1, b"{runaway}", b"", callbacks, 0, 0) is None
        assert create(None, 1, b"{runaway}", b"", callbacks, 0, 0) is None
        assert create(b"a", 7, b"{runaway}", b"", callbacks, 0, 0) is None
        assert create(b"a", 1, b"{runaway}", b"", None, 0, 0) is None
        fmu.lib.fmi2FreeInstance(None)
        fmu.lib.fmi2GetVersion.restype = fmu.lib.fmi2GetTypesPlatform.restype = ct.c_char_p
        assert fmu.lib.fmi2GetVersion() == b"2.0"
        assert fmu.lib.fmi2GetTypesPlatform() == b"default"


def test_bad_value_references_and_values_change_nothing() -> None:
    with Fmi2("linear") as fmu:
        r = fmu.refs
        for vr in (r.g, 10**6, 2**32 - 1):
            assert fmu.raw("SetReal", refs([r.p, vr]), ct.c_size_t(2), doubles([9.0, 9.0])) == ERROR
            assert str(vr) in fmu.log[-1][2]
        for vr in (0, r.dx, r.d, r.w):  # calculated
            assert fmu.raw("SetReal", refs([vr]), ONE, doubles([9.0])) == ERROR
        assert fmu.raw("SetReal", refs([r.p]), ONE, doubles([np.nan])) == DISCARD
        fmu.start()
        assert fmu.get([r.p])[0] == 0.5
        assert fmu.raw("GetReal", refs([2**32 - 1]), ONE, out()) == ERROR
        assert fmu.raw("SetReal", refs([r.x]), ONE, doubles([1.0])) == ERROR
        assert fmu.raw("GetInteger", refs([r.u]), ONE, ints([0])) == ERROR
        for order in (0, 2):
            assert fmu.raw("SetRealInputDerivatives", refs([r.u]), ONE, ints([order]), doubles([1.0])) == ERROR
            assert fmu.raw("GetRealOutputDerivatives", refs([r.w]), ONE, ints([order]), out()) == ERROR
        assert fmu.raw("SetRealInputDerivatives", refs([r.p]), ONE, ints([1]), doubles([1.0])) == ERROR
        assert fmu.raw("GetRealOutputDerivatives", refs([r.w + 3]), ONE, ints([1]), out()) == ERROR


def test_fixed_and_tunable_parameters() -> None:
    with Fmi2("oscillator") as fmu:
        r = fmu.refs
        fmu.start()
        assert fmu.raw("SetReal", refs([r.p]), ONE, doubles([3.0])) == ERROR
        assert "fixed" in fmu.log[-1][2]
        fmu.step(0.0, 0.5)
        fmu.set([r.p + 1], [0.25])  # damping from now on
        fmu.step(0.5, 1.0)
        z, w, t = 0.25, 2.0, 1.0
        s0, v0, wd = np.cos(1.0), -2.0 * np.sin(1.0), 2.0 * np.sqrt(1 - 0.25**2)
        exact = np.exp(-z * w * t) * (s0 * np.cos(wd * t) + (v0 + z * w * s0) / wd * np.sin(wd * t))
        assert fmu.get([r.x])[0] == pytest.approx(exact, abs=1e-6)


def test_calculated_parameters_follow_and_may_fail() -> None:
    with Fmi2("dahlquist") as fmu:
        r = fmu.refs
        fmu.set([r.p], [4.0])
        fmu.start()
        assert fmu.get([r.d])[0] == 0.25
        fmu.set([r.p], [0.5])
        np.testing.assert_array_equal(fmu.get([r.d, r.w + 1]), [2.0, 2.0])
        fmu.set([r.p], [0.0])
        assert fmu.raw("GetReal", refs([r.d]), ONE, out()) == DISCARD


def test_start_values_of_states_before_and_during_initialization() -> None:
    with Fmi2("oscillator") as fmu:
        r = fmu.refs
        fmu.set([r.x], [3.0])
        fmu.setup()
        fmu.call("EnterInitializationMode")
        np.testing.assert_array_equal(fmu.get([r.x, r.w, r.w + 1]), [3.0, 3.0, 18.0])
        fmu.set([r.x + 1, r.p], [1.0, 1.0])
        np.testing.assert_array_equal(fmu.get([r.x, r.dx, r.w + 1]), [3.0, 1.0, 5.0])
        fmu.call("ExitInitializationMode")
        np.testing.assert_array_equal(fmu.get([r.x, r.dx + 1]), [3.0, -3.0])


def test_experiment_settings_are_honoured() -> None:
    with Fmi2("dahlquist") as fmu:
        for bad in ((0.0, -1.0, None), (0.0, None, -1e-6), (np.nan, None, None), (0.0, None, np.nan)):
            with pytest.raises(Refused):
                fmu.setup(*bad)
        fmu.start(start=2.0, stop=3.0)
        fmu.step(2.0, 0.5)
        assert fmu.raw("DoStep", ct.c_double(2.0), ct.c_double(0.1), 1) == ERROR  # wrong communication point
        assert fmu.raw("DoStep", ct.c_double(2.5), ct.c_double(-0.1), 1) == ERROR
        assert fmu.raw("DoStep", ct.c_double(2.5), ct.c_double(np.inf), 1) == ERROR
        assert fmu.raw("DoStep", ct.c_double(2.5), ct.c_double(0.6), 1) == ERROR
        assert "stop time" in fmu.log[-1][2]
        fmu.step(2.5, 0.0)
        fmu.step(2.5, 0.5)
        time, x = fmu.get([0, fmu.refs.x])
        assert time == 3.0
        assert x == pytest.approx(np.exp(-1.0), abs=1e-6)


def test_status_after_a_failed_step() -> None:
    with Fmi2("runaway") as fmu:
        fmu.start()
        fmu.step(0.0, 0.5)
        saved = fmu.save()
        assert fmu.raw("DoStep", ct.c_double(0.5), ct.c_double(1.0), 1) == DISCARD
        status, last, terminated = ct.c_int(), ct.c_double(), ct.c_int()
        fmu.call("GetStatus", 0, ct.byref(status))
        fmu.call("GetRealStatus", 2, ct.byref(last))
        fmu.call("GetBooleanStatus", 3, ct.byref(terminated))
        assert (status.value, last.value, terminated.value) == (DISCARD, 0.5, 0)
        assert fmu.raw("GetRealStatus", 1, ct.byref(last)) == DISCARD  # no such status
        fmu.restore(saved)  # 4.2.2: redo with a shorter step from a saved state
        fmu.step(0.5, 0.25)
        fmu.discard(saved)


def drive(fmu: Fmi2, begin: int = 0, end: int = 60) -> Array:
    """Steps of 10 ms of the stick-slip block with a moving input; the rows are compared bit by bit."""
    r = fmu.refs

    def pull(t: float) -> list[float]:
        return [2.0 * np.cos(20.0 * t), 0.3 * np.sin(5.0 * t)]

    times = np.arange(begin, end + 1) * 0.01
    return run(fmu, times, [0, r.x, r.x + 1, r.x + 2, r.w, r.w + 1, r.w + 2], pull)


def test_reset_is_bit_identical_to_fresh() -> None:
    with Fmi2("stickslip") as fresh:
        expected = drive(fresh.start())
    with Fmi2("stickslip") as fmu:
        fmu.set([fmu.refs.p + 2, fmu.refs.x], [0.7, 0.01])
        drive(fmu.start(tolerance=1e-3, stop=7.0), end=37)
        for _ in range(2):
            fmu.reset()
            np.testing.assert_array_equal(drive(fmu.start()), expected)


def test_saved_states_continue_bit_identically_even_in_another_instance() -> None:
    with Fmi2("stickslip") as one, Fmi2("stickslip") as other:
        drive(one.start(), end=25)
        saved = one.save()
        data = one.serialize(saved)
        expected = drive(one, 25, 60)
        one.restore(saved)
        np.testing.assert_array_equal(drive(one, 25, 60), expected)
        copy = other.deserialize(data)
        other.restore(copy)  # never initialised itself
        np.testing.assert_array_equal(drive(other, 25, 60), expected)
        again = ct.c_void_p(saved.value)
        one.call("GetFMUstate", ct.byref(again))  # reuses the memory
        assert again.value == saved.value
        one.discard(saved)
        assert saved.value is None
        one.discard(saved)  # NULL is fine
        other.discard(copy)


def test_damaged_or_foreign_states_are_refused() -> None:
    with Fmi2("stickslip") as fmu, Fmi2("stickslip", "me") as exchange, Fmi2("linear") as foreign:
        data = fmu.serialize(fmu.save())
        for bad in (data[:-1], data + b"x", b"", data[:40] + bytes([data[40] ^ 1]) + data[41:], data[::-1]):
            target = ct.c_void_p()
            status = fmu.raw("DeSerializeFMUstate", bad, ct.c_size_t(len(bad)), ct.byref(target))
            assert status == ERROR
            assert target.value is None
        for stranger in (exchange, foreign):
            target = ct.c_void_p()
            size = ct.c_size_t(len(data))
            assert stranger.raw("DeSerializeFMUstate", data, size, ct.byref(target)) == ERROR
        assert exchange.raw("SetFMUstate", fmu.save()) == ERROR
        short = ct.create_string_buffer(8)
        assert fmu.raw("SerializeFMUstate", fmu.save(), short, ct.c_size_t(8)) == ERROR


@pytest.mark.parametrize("model", ["dahlquist", "oscillator", "stickslip", "saturation", "bench", "linear"])
def test_directional_derivatives_against_differences(model: str) -> None:
    """Every unknown by every known, by central differences of the same FMU in Model Exchange."""
    with Fmi2(model, "me") as fmu:
        r = fmu.refs
        inputs = list(range(r.u, r.u + r.n.u))
        fmu.set(inputs, [0.03 * (k + 1) for k in range(r.n.u)])
        fmu.start(start=0.3)
        x0 = np.array([0.02 * (k + 1) for k in range(r.n.x)])
        unknown = [*range(r.dx, r.dx + r.n.x), *range(r.w, r.w + r.n.w)]

        def values(vr: int, delta: float) -> Array:
            x = x0.copy()
            if r.n.x:
                fmu.call("EnterContinuousTimeMode")
                if vr < r.dx:
                    x[vr - r.x] += delta
                fmu.set_states(x)
                fmu.call("EnterEventMode")
            old = fmu.get([vr])[0] if vr >= r.dx else 0.0
            if vr >= r.dx:
                fmu.set([vr], [old + delta])
            found = fmu.get(unknown)
            if vr >= r.dx:
                fmu.set([vr], [old])
            return found

        if r.n.x:
            values(r.x, 0.0)
        fmu.update_events()
        known = [*range(r.x, r.x + r.n.x), *inputs]
        tunable = {"dahlquist": [0], "oscillator": [1], "stickslip": [2, 3, 6], "linear": [0, 1, 2, 3]}
        known += [r.p + k for k in tunable.get(model, [0, 1, 2])]
        if model in ("bench", "saturation"):
            known = [vr for vr in known if vr != r.p + 1 or model == "saturation"]
        for vr in known:
            delta = 1e-6 * max(1.0, abs(fmu.get([vr])[0]))
            difference = (values(vr, delta) - values(vr, -delta)) / (2.0 * delta)
            values(r.x, 0.0) if r.n.x else None
            exact = fmu.directional(unknown, [vr], [1.0])
            np.testing.assert_allclose(exact, difference, rtol=2e-5, atol=2e-5 * max(1.0, np.abs(exact).max()))
        if len(known) > 1:  # linear in the seeds, a known named twice counts twice
            both = fmu.directional(unknown, [known[0], known[1], known[0]], [1.0, -2.0, 0.5])
            one, two = (fmu.directional(unknown, [vr], [1.0]) for vr in known[:2])
            np.testing.assert_allclose(both, 1.5 * one - 2.0 * two, rtol=1e-12, atol=1e-12)
        for bad_unknown, bad_known in (([r.p], [known[0]]), (unknown[:1], [unknown[0]]), ([10**6], [known[0]])):
            with pytest.raises(Refused):
                fmu.directional(bad_unknown, bad_known, [1.0])


def test_output_derivatives() -> None:
    """dy/dt including the outputs' direct dependence on inputs and time."""
    with Fmi2("linear") as fmu:
        r = fmu.refs
        fmu.start(tolerance=1e-9)
        fmu.set([r.u, r.u + 1], [0.2, -0.4])
        fmu.slopes([r.u, r.u + 1], [3.0, 1.0])
        fmu.step(0.0, 0.7)
        x = fmu.get([r.x, r.x + 1, r.x + 2])
        u = np.array([0.2 + 2.1, -0.4 + 0.7])
        dx1 = x[0] - 2.0 * x[1] + 2.0 * u[1] + np.cos(0.7)
        expected = [-0.5 * x[0] + u[0], dx1 + 3.0 + np.cos(0.7), 3.0 * (x[1] - 1000.0 * x[2])]
        np.testing.assert_allclose(fmu.output_slopes([r.w, r.w + 1, r.w + 2]), expected, rtol=1e-8, atol=1e-8)


def test_logging_is_silent_by_default_and_by_category() -> None:
    with Fmi2("stickslip") as fmu:
        drive(fmu.start())
        assert fmu.log == []
        names = (ct.c_char_p * 1)(b"logEvents")
        fmu.call("SetDebugLogging", 1, ONE, names)
        drive(fmu, 60, 120)
        assert {category for _status, category, _text in fmu.log} == {"logEvents"}
        count = len(fmu.log)
        fmu.call("SetDebugLogging", 0, ct.c_size_t(0), None)
        drive(fmu, 120, 150)
        assert len(fmu.log) == count
        assert fmu.raw("SetDebugLogging", 1, ONE, (ct.c_char_p * 1)(b"100% wrong")) == ERROR
        assert "%" not in fmu.log[-1][2]  # importers use messages as formats
        assert fmu.raw("SetDebugLogging", 1, ONE, (ct.c_char_p * 1)(None)) == ERROR


def exchange(fmu: Fmi2, end: float, tolerance: float = 1e-9) -> tuple[Array, int]:
    """Integrate a Model Exchange instance by Radau with event location; returns the final states, the events."""
    r = fmu.refs
    fmu.start()
    fmu.update_events()
    fmu.call("EnterContinuousTimeMode")
    x, t, events = fmu.vector("GetContinuousStates", r.n.x), 0.0, 0

    def at(time: float, states: Array) -> None:
        fmu.set_time(time)
        fmu.set_states(states)

    def rhs(time: float, states: Array) -> Array:
        at(time, states)
        return fmu.vector("GetDerivatives", r.n.x)

    def indicator(k: int) -> Callable[[float, Array], float]:
        def g(time: float, states: Array) -> float:
            at(time, states)
            return float(fmu.vector("GetEventIndicators", r.n.g)[k])

        g.terminal = True  # type: ignore[attr-defined]
        return g

    scale = fmu.vector("GetNominalsOfContinuousStates", r.n.x)
    while t < end:
        found = solve_ivp(
            *(rhs, (t, end), x, "Radau"),
            events=[indicator(k) for k in range(r.n.g)],
            rtol=tolerance,
            atol=tolerance * scale * 1e-2,
            max_step=0.02,
        )
        assert found.success
        t, x = found.t[-1], found.y[:, -1]
        at(t, x)
        enter_event, terminate = ct.c_int(), ct.c_int()
        fmu.call("CompletedIntegratorStep", 1, ct.byref(enter_event), ct.byref(terminate))
        if found.status == 1:
            at(t + 1e-12, x + 1e-12 * rhs(t, x))  # just past the root
            events += 1
            fmu.call("EnterEventMode")
            fmu.update_events()
            fmu.call("EnterContinuousTimeMode")
            t += 1e-12
    return x, events


def test_model_exchange_agrees_with_co_simulation() -> None:
    with Fmi2("stickslip", "me") as fmu:
        x, events = exchange(fmu, 0.9)
    with Fmi2("stickslip", logging=True) as cs:
        r = cs.refs
        cs.start(tolerance=1e-8)
        cs.step(0.0, 0.9)
        expected = cs.get([r.x, r.x + 1, r.x + 2])
        assert events == cs.events()
    np.testing.assert_allclose(x, expected, rtol=1e-5, atol=1e-9)


def test_indicators_are_frozen_between_events_and_never_zero() -> None:
    with Fmi2("stickslip", "me") as fmu:
        r = fmu.refs
        fmu.set([r.x + 1], [1e-7])  # exactly on the border: v = v_r
        fmu.start()
        fmu.update_events()
        fmu.call("EnterContinuousTimeMode")
        g = fmu.vector("GetEventIndicators", 2)
        assert np.all(g != 0.0)
        friction = fmu.get([r.w + 2])[0]
        fmu.set_states([0.0, 2e-7, 0.0])
        assert fmu.vector("GetEventIndicators", 2)[0] > 0.0
        assert fmu.get([r.w + 2])[0] == pytest.approx(2.0 * friction, rel=1e-6)  # beyond its border
        wanted, terminate = ct.c_int(), ct.c_int()
        fmu.call("CompletedIntegratorStep", 1, ct.byref(wanted), ct.byref(terminate))
        assert wanted.value == 1  # an importer that locates no roots is told
        fmu.call("EnterEventMode")
        fmu.update_events()
        assert fmu.get([r.w + 2])[0] == pytest.approx(friction, rel=1e-6)
        fmu.set([r.p + 2], [5.0])  # tunable in Event Mode
        fmu.call("EnterContinuousTimeMode")
        assert fmu.raw("SetReal", refs([r.p + 2]), ONE, doubles([1.0])) == ERROR
        for name in ("GetDerivatives", "GetContinuousStates", "GetNominalsOfContinuousStates"):
            assert fmu.raw(name, out(4), ct.c_size_t(4)) == ERROR
        assert fmu.raw("SetContinuousStates", doubles([1.0, 1.0]), ct.c_size_t(2)) == ERROR
        assert fmu.raw("SetContinuousStates", doubles([1.0, np.nan, 0.0]), ct.c_size_t(3)) == DISCARD


def test_model_exchange_beyond_its_domain_is_a_discard() -> None:
    with Fmi2("runaway", "me") as fmu:
        fmu.start()
        fmu.call("EnterContinuousTimeMode")
        fmu.set_time(2.0)
        assert fmu.raw("GetDerivatives", out(), ONE) == DISCARD
        fmu.set_time(0.5)
        assert fmu.vector("GetDerivatives", 1)[0] == pytest.approx(1.0 + np.sqrt(0.5))


def test_instances_in_threads_equal_serial_runs() -> None:
    def one(seed: int) -> Array:
        with Fmi2("stickslip") as fmu:
            fmu.set([fmu.refs.p + 2], [1.0 + 0.01 * seed])
            return drive(fmu.start())

    serial = [one(seed) for seed in range(6)]
    with ThreadPoolExecutor(6) as pool:
        for found, expected in zip(pool.map(one, range(6)), serial, strict=True):
            np.testing.assert_array_equal(found, expected)


def resident() -> int:
    gc.collect()
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def test_memory_is_flat_over_10000_instances_and_10000_resets() -> None:
    with Fmi2("stickslip") as fmu:
        create, free = fmu.lib.fmi2Instantiate, fmu.lib.fmi2FreeInstance
        arguments = (b"one", 1, b"{stickslip}", b"", ct.byref(fmu.callbacks), 0, 0)

        def instances(n: int) -> None:
            for _ in range(n):
                free(ct.c_void_p(create(*arguments)))

        def resets(n: int) -> None:
            for _ in range(n):
                fmu.start()
                fmu.step(0.0, 1e-3)
                saved = fmu.save()
                fmu.restore(saved)
                fmu.discard(saved)
                fmu.reset()

        for cycle in (instances, resets):
            cycle(1000)
            before = resident()
            cycle(10000)
            assert resident() - before < 500  # kB; one leaked instance each would be 30 MB
