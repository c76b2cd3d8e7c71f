"""The FMI 2.0 layer of exported FMUs: state machine, value references, saved states, Model Exchange."""

from __future__ import annotations

import ctypes as ct
import gc
import resource
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from runtime.fmi2 import Fmi2
from runtime.fmi3 import run
from runtime.harness import DISCARD, ERROR, Array, Refused, doubles, ints, refs, sizes

R = sizes("runaway")  # negative parameter: cannot be initialised; fails beyond time 1
ONE = ct.c_size_t(1)


def out(n: int = 1) -> ct.Array[ct.c_double]:
    return (ct.c_double * n)()


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
            assert (
                fmu.raw("SetRealInputDerivatives", refs([r.u]), ONE, ints([order]), doubles([1.0])) == ERROR
            )
            assert fmu.raw("GetRealOutputDerivatives", refs([r.w]), ONE, ints([order]), out()) == ERROR
        assert fmu.raw("SetRealInputDerivatives", refs([r.p]), ONE, ints([1]), doubles([1.0])) == ERROR
        assert fmu.raw("GetRealOutputDerivatives", refs([r.w + 3]), ONE, ints([1]), out()) == ERROR


def test_no_nan_comes_out_of_a_failed_initialization() -> None:
    with Fmi2("runaway") as fmu:
        fmu.set([R.p], [-1.0])
        fmu.setup()
        fmu.call("EnterInitializationMode")
        assert fmu.raw("ExitInitializationMode") == ERROR
        assert "initial equations" in fmu.log[-1][2]
        assert fmu.get([R.x])[0] == 0.0
        assert fmu.raw("GetReal", refs([R.dx]), ONE, out()) == DISCARD
        fmu.reset()
        fmu.start().step(0.0, 0.5)


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


def test_logging_is_silent_by_default_and_by_category() -> None:
    with Fmi2("stickslip") as fmu:
        drive(fmu.start())
        assert fmu.log == []
        names = (ct.c_char_p * 1)(b"logEvents")
        fmu.call("SetDebugLogging", 1, ONE, names)
        drive(fmu, 60, 120)
        assert {category for _status, category, _text in fmu.log} == {"logEvents"}
        fmu.call("SetDebugLogging", 1, ONE, (ct.c_char_p * 1)(b"logSolver"))
        drive(fmu, 120, 150)
        assert {category for _status, category, _text in fmu.log} == {"logEvents", "logSolver"}
        count = len(fmu.log)
        fmu.call("SetDebugLogging", 0, ct.c_size_t(0), None)
        drive(fmu, 150, 180)
        assert len(fmu.log) == count
        assert fmu.raw("SetDebugLogging", 1, ONE, (ct.c_char_p * 1)(b"100% wrong")) == ERROR
        assert "%" not in fmu.log[-1][2]  # importers use messages as formats
        assert fmu.raw("SetDebugLogging", 1, ONE, (ct.c_char_p * 1)(None)) == ERROR


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
