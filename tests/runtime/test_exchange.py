"""Model Exchange (FMI 2.0) and directional derivatives of exported FMUs."""

from __future__ import annotations

import ctypes as ct
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from runtime.fmi2 import Fmi2
from runtime.harness import DISCARD, ERROR, Array, Refused, doubles, refs

ONE = ct.c_size_t(1)


def out(n: int = 1) -> ct.Array[ct.c_double]:
    return (ct.c_double * n)()


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
            np.testing.assert_allclose(
                exact, difference, rtol=2e-5, atol=2e-5 * max(1.0, np.abs(exact).max())
            )
        if len(known) > 1:  # linear in the seeds, a known named twice counts twice
            both = fmu.directional(unknown, [known[0], known[1], known[0]], [1.0, -2.0, 0.5])
            one, two = (fmu.directional(unknown, [vr], [1.0]) for vr in known[:2])
            np.testing.assert_allclose(both, 1.5 * one - 2.0 * two, rtol=1e-12, atol=1e-12)
        for bad_unknown, bad_known in (
            ([r.p], [known[0]]),
            (unknown[:1], [unknown[0]]),
            ([10**6], [known[0]]),
        ):
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
