"""The Co-Simulation solver of exported FMUs against closed forms and independent references."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from runtime.fmi2 import Fmi2
from runtime.fmi3 import run
from runtime.harness import DISCARD, Array, Refused, sizes


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7, 1e-9])
@pytest.mark.parametrize("steps", [1, 7, 200])
def test_decay_is_exact_to_the_tolerance(tolerance: float, steps: int) -> None:
    times = np.linspace(0.0, 3.0, steps + 1)
    with Fmi2("dahlquist") as fmu:
        x = run(fmu.start(tolerance=tolerance), times, [fmu.refs.w])[:, 0]
    assert np.abs(x - np.exp(-times)).max() < tolerance


@pytest.mark.parametrize(("tolerance", "bound"), [(1e-4, 1e-4), (1e-6, 2e-6), (1e-8, 2e-8)])
def test_undamped_oscillation_over_many_periods(tolerance: float, bound: float) -> None:
    times = np.linspace(0.0, 30.0, 11)
    with Fmi2("oscillator") as fmu:
        found = run(fmu.start(tolerance=tolerance), times, [fmu.refs.x, fmu.refs.w + 1])
    assert np.abs(found[:, 0] - np.cos(2.0 * times)).max() < bound
    assert np.abs(found[:, 1] - 2.0).max() < 4.0 * bound  # energy


def test_the_order_of_the_method_is_at_least_five() -> None:
    """With a tolerance that never binds, halving the communication step divides the error by at least 2^5."""
    errors = []
    for steps in (40, 80, 160):
        times = np.linspace(0.0, 10.0, steps + 1)
        with Fmi2("oscillator") as fmu:
            x = run(fmu.start(tolerance=1e-2), times, [fmu.refs.x])[:, 0]
        errors.append(np.abs(x - np.cos(2.0 * times)).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 4.6)


def van_der_pol(times: Array) -> Array:
    def rhs(_t: float, x: Array) -> list[float]:
        return [x[1], 1000.0 * (1.0 - x[0] ** 2) * x[1] - x[0]]

    def jacobian(_t: float, x: Array) -> list[list[float]]:
        return [[0.0, 1.0], [-2000.0 * x[0] * x[1] - 1.0, 1000.0 * (1.0 - x[0] ** 2)]]

    found = solve_ivp(
        rhs, times[[0, -1]], [2.0, 0.0], "Radau", times, jac=jacobian, rtol=1e-10, atol=[1e-11, 1e-13]
    )
    return np.asarray(found.y[0])


def test_van_der_pol_relaxation_is_stiff_and_right() -> None:
    times = np.linspace(0.0, 2000.0, 401)
    reference = van_der_pol(times)
    for tolerance in (1e-4, 1e-6):
        with Fmi2("vanderpol") as fmu:
            x = run(fmu.start(tolerance=tolerance), times, [fmu.refs.x])[:, 0]
        assert np.abs(x - reference).max() / np.ptp(reference) < 10.0 * tolerance


def linear_exact(times: Array, inputs: Callable[[float], Array], knots: Array) -> Array:
    """x' = A x + B u + c cos(t) with u linear between knots, by matrix exponentials of the extended system."""
    a = np.array([[-0.5, 0.0, 0.0], [1.0, -2.0, 0.0], [0.0, 1.0, -1000.0]])
    b = np.array([[1.0, 0.0], [0.0, 2.0], [0.0, 0.0]])
    x, rows = np.array([1.0, 0.0, 0.0]), []
    grid = np.unique(np.concatenate([times, knots[knots < times[-1]]]))
    for begin, end in pairwise(grid):
        if begin in times:
            rows.append(x)
        u, then = inputs(begin), inputs(end)
        big = np.zeros((9, 9))  # x, u, u', cos t, sin t
        big[:3, :3], big[:3, 3:5], big[1, 7] = a, b, 1.0
        big[3:5, 5:7] = np.eye(2)
        big[7, 8], big[8, 7] = -1.0, 1.0
        start = np.concatenate([x, u, (then - u) / (end - begin), [np.cos(begin), np.sin(begin)]])
        x = (expm(big * (end - begin)) @ start)[:3]
    return np.array([*rows, x])


KNOTS = np.array([0.0, 0.5, 1.25, 2.0, 3.0])
COURSE = np.array([[0.0, 1.0], [1.0, 1.0], [-1.0, 0.0], [0.5, 2.0], [0.5, -1.0]])


def piecewise(time: float) -> Array:
    return np.array([np.interp(time, KNOTS, COURSE[:, k]) for k in range(2)])


@pytest.mark.parametrize("pieces", [12, 24, 120])
def test_piecewise_linear_inputs_are_exact(pieces: int) -> None:
    """No one-step hold: with kinks at communication points only the solver's error is left."""
    times = np.linspace(0.0, 3.0, pieces + 1)
    exact = linear_exact(times, piecewise, KNOTS)
    with Fmi2("linear") as fmu:
        states = [fmu.refs.x, fmu.refs.x + 1, fmu.refs.x + 2]
        found = run(fmu.start(tolerance=1e-8), times, states, piecewise)
    assert np.all(np.abs(found - exact).max(axis=0) < 3e-8 * np.abs(exact).max(axis=0))


def test_inputs_without_derivatives_are_held_over_the_step() -> None:
    with Fmi2("linear") as fmu:
        fmu.start(tolerance=1e-9)
        fmu.set([fmu.refs.u], [1.0])
        fmu.step(0.0, 1.0)
        assert fmu.get([fmu.refs.x])[0] == pytest.approx(np.exp(-0.5) + 2.0 * (1 - np.exp(-0.5)), rel=1e-9)


def test_input_derivatives_hold_for_one_step() -> None:
    with Fmi2("linear") as fmu:
        u = fmu.refs.u
        fmu.start()
        fmu.set([u], [1.0])
        fmu.slopes([u], [2.0])
        fmu.step(0.0, 0.5)
        assert fmu.get([u])[0] == pytest.approx(2.0)
        fmu.step(0.5, 0.5)
        assert fmu.get([u])[0] == pytest.approx(2.0)


def test_random_linear_runs_do_not_depend_on_the_communication_step() -> None:
    rng = np.random.default_rng(1)
    knots = np.linspace(0.0, 2.0, 9)
    for _ in range(5):
        course = rng.normal(size=(9, 2))

        def inputs(time: float, course: Array = course) -> Array:
            return np.array([np.interp(time, knots, course[:, k]) for k in range(2)])

        results = []
        for pieces in (8, 16, 64):
            with Fmi2("linear") as fmu:
                y = run(fmu.start(), np.linspace(0.0, 2.0, pieces + 1), [fmu.refs.w, fmu.refs.w + 1], inputs)
            results.append(y[:: pieces // 8])
        for other in results[1:]:
            assert np.abs(other - results[0]).max() < 2e-6


# Stick-slip: the same regularised equations, events ignored, by Radau.

M, K, F_C, F_S, V_S, V_R, B = 1.0, 100.0, 1.0, 1.5, 0.01, 1e-7, 0.5


def block(
    times: Array, pull: Callable[[float], float], load: Callable[[float], float] = lambda _t: 0.0
) -> Array:
    def friction(v: float) -> float:
        return (F_C + (F_S - F_C) * np.exp(-((v / V_S) ** 2))) * float(np.clip(v / V_R, -1.0, 1.0)) + B * v

    def rhs(t: float, x: Array) -> list[float]:
        return [pull(t) - x[1], (K * x[0] - load(t) - friction(x[1])) / M, x[1]]

    def jacobian(_t: float, x: Array) -> list[list[float]]:
        v, bell = x[1], np.exp(-((x[1] / V_S) ** 2))
        slope = (F_C + (F_S - F_C) * bell) * (abs(v) <= V_R) / V_R + B
        slope -= (F_S - F_C) * bell * 2.0 * v / V_S**2 * np.clip(v / V_R, -1.0, 1.0)
        return [[0.0, -1.0, 0.0], [K / M, -slope / M, 0.0], [0.0, 1.0, 0.0]]

    found = solve_ivp(
        rhs, times[[0, -1]], [0.0] * 3, "Radau", times, jac=jacobian, rtol=1e-9, atol=1e-12, max_step=2e-3
    )
    assert found.success
    return np.asarray(found.y.T)


@pytest.fixture(scope="module")
def pulled() -> tuple[Array, Array]:
    times = np.linspace(0.0, 3.0, 301)
    return times, block(times, lambda _t: 0.05)


@pytest.mark.parametrize(("tolerance", "bound"), [(1e-4, 3e-4), (1e-6, 1e-5), (1e-8, 1e-6)])
def test_stick_slip_matches_the_event_free_reference(
    pulled: tuple[Array, Array], tolerance: float, bound: float
) -> None:
    times, reference = pulled
    for pieces in (1, 2, 10):
        fine = np.linspace(0.0, times[-1], pieces * (len(times) - 1) + 1)
        with Fmi2("stickslip", logging=True) as fmu:
            states = range(fmu.refs.x, fmu.refs.x + 3)
            found = run(fmu.start(tolerance=tolerance), fine, list(states))[::pieces]
            assert fmu.events() == 8  # four breakaways, four captures: each is one event, none is missed
        assert np.all(np.abs(found - reference).max(axis=0) < bound * np.ptp(reference, axis=0))


def test_friction_reversals_within_large_communication_steps() -> None:
    """The spring end moves to and fro; a communication step holds several reversals."""

    def pull(time: float) -> float:
        return float(np.interp(time, [0.0, 0.5, 1.0, 1.5, 2.0], [0.3, -0.3, 0.3, -0.3, 0.3]))

    times = np.linspace(0.0, 2.0, 5)
    reference = block(times, pull)
    with Fmi2("stickslip", logging=True) as fmu:
        states = list(range(fmu.refs.x, fmu.refs.x + 3))
        found = run(fmu.start(), times, states, lambda t: [pull(t), 0.0])
        assert 6 <= fmu.events() <= 60
    assert np.all(np.abs(found - reference).max(axis=0) < 1e-5 * np.abs(reference).max(axis=0) + 1e-8)


@pytest.mark.parametrize("load", [0.0, 0.3, -1.4])
def test_rest_under_load_creeps_as_the_regularisation_says(load: float) -> None:
    """A stuck block under a load below the friction limit: v = v_r load / F_S, no chatter, no events."""
    times = np.linspace(0.0, 10.0, 1001)
    with Fmi2("stickslip", logging=True) as fmu:
        fmu.set([fmu.refs.u, fmu.refs.u + 1], [0.0, load])
        v = run(fmu.start(), times, [fmu.refs.x + 1, fmu.refs.x + 2])
        assert fmu.events() == 0
    assert v[-1, 0] == pytest.approx(-V_R * load / F_S, rel=1e-3, abs=1e-15)
    assert abs(v[-1, 1]) <= 10.0 * V_R * abs(load) / F_S * 1.001


@pytest.mark.parametrize("pieces", [20, 40, 400])
def test_saturated_integrator_holds_and_releases(pieces: int) -> None:
    """PI controller driven into both limits, against Radau on the unfrozen equations."""
    k, ki, limit, band, tau = 5.0, 20.0, 1.0, 1e-3, 0.1
    knots = np.array([0.0, 0.1, 0.3, 0.4, 1.0])
    course = np.array([0.0, 2.0, 2.0, -2.0, 0.3])

    def rhs(t: float, x: Array) -> list[float]:
        e = np.interp(t, knots, course) - x[0]
        z = k * e + x[1]
        hold = np.clip(1.0 - (abs(z) - limit) / band, 0.0, 1.0)
        return [(np.clip(z, -limit, limit) - x[0]) / tau, ki * e * hold]

    times = np.linspace(0.0, 2.0, pieces + 1)
    solved = solve_ivp(rhs, (0.0, 2.0), [0.0, 0.0], "Radau", times, rtol=1e-9, atol=1e-11, max_step=1e-3)
    with Fmi2("saturation", logging=True) as fmu:
        found = run(
            fmu.start(),
            times,
            [fmu.refs.x, fmu.refs.x + 1],
            lambda t: [float(np.interp(t, knots, course)), 0.0],
        )
        assert 4 <= fmu.events() <= 20
    assert np.abs(found - solved.y.T).max() < 1e-5 * np.ptp(solved.y)


@pytest.mark.parametrize("excess", [-1e-6, 0.0, 1e-12, 1e-8, 1e-4, 0.5])
@pytest.mark.parametrize("steps", [1, 2, 7, 500])
def test_short_excursions_are_found_and_touching_is_no_event(excess: float, steps: int) -> None:
    """g = a - (t - 1)^2 is positive for 2 sqrt(a) seconds only: 4/3 a^1.5 is gained there."""
    with Fmi2("kink", logging=True) as fmu:
        fmu.set([fmu.refs.p], [excess])
        x = run(fmu.start(), np.linspace(0.0, 2.0, steps + 1), [fmu.refs.x])[-1, 0]
        assert fmu.events() == (2 if excess > 0.0 else 0)
    assert x == pytest.approx(2.0 + 4.0 / 3.0 * max(excess, 0.0) ** 1.5, abs=1e-11)


def test_a_sliding_mode_is_crossed_in_bounded_time_with_a_warning() -> None:
    """Outside the contract (discontinuous right-hand side), yet neither a hang nor nonsense."""
    with Fmi2("sliding", logging=True) as fmu:
        x = run(fmu.start(), np.linspace(0.0, 1.0, 11), [fmu.refs.x])[:, 0]
        assert np.abs(x - np.maximum(0.3 - np.linspace(0.0, 1.0, 11), 0.0)).max() < 1e-3
        assert any(category == "logStatusWarning" for _status, category, _text in fmu.log)


def test_static_model_follows_its_inputs_at_once() -> None:
    with Fmi2("bench") as fmu:
        fmu.start()
        for v in (0.009, -0.002, 0.0, 5e-8, -3e-3):
            fmu.set([fmu.refs.u], [v])
            force = 2700.0 * np.clip(v / 1e-7, -1.0, 1.0) + 4e4 * v
            np.testing.assert_allclose(fmu.get([fmu.refs.w, fmu.refs.w + 1]), [force, force * v], rtol=1e-12)
        fmu.slopes([fmu.refs.u], [6.0])
        fmu.step(0.0, 1e-3)
        assert fmu.get([fmu.refs.u, fmu.refs.w])[1] == pytest.approx(2700.0 + 4e4 * 3e-3)


def test_failure_is_a_discard_with_a_reason_and_no_nan() -> None:
    with Fmi2("runaway") as fmu:
        fmu.start()
        fmu.step(0.0, 0.5)
        before = fmu.get([0, fmu.refs.x])
        with pytest.raises(Refused) as caught:
            fmu.step(0.5, 1.0)
        assert caught.value.status == DISCARD
        assert fmu.log[-1][1] == "logStatusDiscard"
        assert "cannot be evaluated at time" in fmu.log[-1][2]
        np.testing.assert_array_equal(fmu.get([0, fmu.refs.x]), before)  # back at the communication point


def test_the_step_size_is_remembered_across_communication_points() -> None:
    """From one long step to many short ones and back: the run costs no restart, so the result is as good."""
    refs = sizes("oscillator")
    times = np.concatenate([[0.0, 2.0], 2.0 + np.arange(1, 200) * 1e-4, [4.0, 6.0]])
    with Fmi2("oscillator") as fmu:
        x = run(fmu.start(tolerance=1e-8), times, [refs.x])[:, 0]
    assert np.abs(x - np.cos(2.0 * times)).max() < 1e-7
