"""Whole runs in one call (trajectory.h): against closed forms, SciPy, and the same FMU stepped through its samples."""

from __future__ import annotations

import ctypes as ct
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from runtime.fmi2 import Fmi2
from runtime.fmi3 import Fmi3, run
from runtime.harness import DISCARD, ERROR, OK, Array
from runtime.test_solver import COURSE, KNOTS, block, linear_exact, piecewise
from thsa_cosim.fmu.trajectory import FUNCTION, Trajectory

Fmu = Fmi2 | Fmi3


class Table(NamedTuple):
    """Inputs from ``starts`` (m,) on: ``values`` + ``slopes`` (t - start), (m, inputs) each."""

    starts: Array
    values: Array
    slopes: Array


NOTHING = Table(np.zeros(1), np.zeros((1, 0)), np.zeros((1, 0)))


def broken_line(knots: Array, course: Array) -> Table:
    """Linear between ``knots`` (m,) through ``course`` (m, inputs), constant after the last."""
    slopes = np.zeros_like(course)
    slopes[:-1] = np.diff(course, axis=0) / np.diff(knots)[:, None]
    return Table(knots, course, slopes)


def held(knots: Array, course: Array) -> Table:
    """Jumps at ``knots``."""
    return Table(knots, course, np.zeros_like(course))


class Followed(NamedTuple):
    status: int
    rows: Array
    """(times, outputs); NaN where not filled."""
    report: Trajectory


def follow(
    fmu: Fmu,
    times: Array,
    outputs: Sequence[int],
    table: Table = NOTHING,
    wrong: dict[str, np.ndarray] | None = None,
) -> Followed:
    """Call the function; ``wrong`` replaces fields of its struct."""
    inputs = [fmu.refs.u + k for k in range(table.values.shape[1])]
    arrays = {
        "inputs": np.array(inputs, dtype=np.uint32),
        "starts": np.ascontiguousarray(table.starts),
        "values": np.ascontiguousarray(table.values),
        "slopes": np.ascontiguousarray(table.slopes),
        "outputs": np.array(outputs, dtype=np.uint32),
        "times": np.ascontiguousarray(times),
    }
    arrays |= wrong or {}
    rows = np.full((len(outputs), len(times)), np.nan)
    report = Trajectory(len(inputs), len(table.starts), len(outputs), len(times))
    for name, array in arrays.items():
        setattr(report, name, array.ctypes.data)
    report.results = rows.ctypes.data
    handle = fmu.component if isinstance(fmu, Fmi2) else fmu.instance
    status = getattr(fmu.lib, FUNCTION)(ct.c_void_p(handle), ct.byref(report))
    return Followed(status, rows.T, report)


@pytest.fixture(params=[Fmi2, Fmi3], ids=["fmi2", "fmi3"])
def version(request: pytest.FixtureRequest) -> type[Fmu]:
    return request.param


@pytest.mark.parametrize("count", [2, 5, 301])
def test_kinks_between_output_times_are_exact(version: type[Fmu], count: int) -> None:
    """Coarse and fine grids of outputs alike: kinks lie where they are, not where outputs are."""
    times = np.linspace(0.0, 3.0, count)
    exact = linear_exact(times, piecewise, KNOTS)
    with version("linear") as fmu:
        found = follow(
            fmu.start(tolerance=1e-9), times, [fmu.refs.x + k for k in range(3)], broken_line(KNOTS, COURSE)
        )
    assert found.status == OK
    assert np.all(np.abs(found.rows - exact).max(axis=0) < 1e-8 * np.abs(exact).max(axis=0))


def test_steps_cross_samples() -> None:
    """A thousand times as many outputs cost not one step more."""
    steps = []
    for count in (5, 5001):
        with Fmi2("linear") as fmu:
            times = np.linspace(0.0, 3.0, count)
            steps.append(follow(fmu.start(), times, [fmu.refs.x], broken_line(KNOTS, COURSE)).report.steps)
    assert steps[0] == steps[1] < 100


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7, 1e-9])
def test_every_sample_is_as_exact_as_the_tolerance_asks(tolerance: float) -> None:
    """Dense output errs no more than the ends of the steps do: an undamped oscillation."""
    times = np.linspace(0.0, 3.0, 1001)
    with Fmi2("oscillator") as fmu:
        found = follow(fmu.start(tolerance=tolerance), times, [fmu.refs.x])
    assert np.abs(found.rows[:, 0] - np.cos(2.0 * times)).max() < 3.0 * tolerance


def test_held_inputs_jump_and_equal_values_are_no_jump() -> None:
    """x' = -a x + u0 with u0 held: exponentials, restarted at every jump."""
    knots, course = (
        np.array([0.0, 0.4, 0.7, 1.1]),
        np.array([[1.0, 0.0], [-2.0, 0.0], [-2.0, 0.0], [0.5, 0.0]]),
    )
    times = np.linspace(0.0, 2.0, 41)
    exact, x, begin = [], 1.0, 0.0
    for time in times:
        level = course[np.searchsorted(knots, time - 1e-12, side="right") - 1, 0]
        x = 2.0 * level + (x - 2.0 * level) * np.exp(-0.5 * (time - begin))
        exact.append(x)
        begin = time
    with Fmi2("linear", logging=True) as fmu:
        fmu.set([fmu.refs.u, fmu.refs.u + 1], course[0])
        found = follow(fmu.start(tolerance=1e-9), times, [fmu.refs.x, fmu.refs.u], held(knots, course))
    np.testing.assert_allclose(found.rows[:, 0], exact, rtol=1e-8)
    at = np.searchsorted(knots, times + 1e-12, side="right") - 1
    np.testing.assert_array_equal(found.rows[:, 1], course[at, 0])  # at the jump itself the new value


def test_feed_through_of_a_static_model_is_exact_at_every_sample(version: type[Fmu]) -> None:
    """No states: relations are settled at each sample."""
    times = np.linspace(0.0, 1.0, 101)
    knots, course = np.array([0.0, 0.25, 0.5, 0.75]), np.array([[9e-3], [-2e-3], [5e-8], [-3e-3]])
    for table in (held(knots, course), broken_line(knots, course)):
        with version("bench") as fmu:
            fmu.set([fmu.refs.u], course[0])
            found = follow(fmu.start(), times, [fmu.refs.u, fmu.refs.w, fmu.refs.w + 1], table)
        at = np.searchsorted(knots, times + 1e-12, side="right") - 1
        v = table.values[at, 0] + table.slopes[at, 0] * (times - knots[at])
        force = 2700.0 * np.clip(v / 1e-7, -1.0, 1.0) + 4e4 * v
        np.testing.assert_allclose(found.rows, np.column_stack([v, force, force * v]), rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(
    ("count", "tolerance", "bound"), [(4, 1e-6, 1e-5), (301, 1e-6, 1e-5), (301, 1e-8, 1e-6)]
)
def test_stick_slip_on_coarse_and_fine_grids(count: int, tolerance: float, bound: float) -> None:
    times = np.linspace(0.0, 3.0, count)
    reference = block(times, lambda _t: 0.05)
    with Fmi2("stickslip", logging=True) as fmu:
        states = [fmu.refs.x + k for k in range(3)]
        found = follow(fmu.start(tolerance=tolerance), times, states)
        assert found.report.events == fmu.events() == 8  # as on a grid of samples
    assert np.all(np.abs(found.rows - reference).max(axis=0) < bound * np.ptp(reference, axis=0))


def test_friction_reversals_under_a_broken_line() -> None:
    knots = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    pull = np.array([0.3, -0.3, 0.3, -0.3, 0.3])
    times = np.linspace(0.0, 2.0, 401)
    reference = block(times, lambda t: float(np.interp(t, knots, pull)))
    with Fmi2("stickslip") as fmu:
        states = [fmu.refs.x + k for k in range(3)]
        found = follow(fmu.start(), times, states, broken_line(knots, np.column_stack([pull, 0.0 * pull])))
    assert np.all(np.abs(found.rows - reference).max(axis=0) < 1e-5 * np.abs(reference).max(axis=0) + 1e-8)


@pytest.mark.parametrize("jumps", [False, True])
def test_saturation_under_kinks_and_jumps(jumps: bool) -> None:
    """A PI controller driven into both limits, against Radau over each segment of the input."""
    k, ki, limit, band, tau = 5.0, 20.0, 1.0, 1e-3, 0.1
    knots, course = np.array([0.0, 0.1, 0.3, 0.4, 1.0]), np.array([0.0, 2.0, 2.0, -2.0, 0.3])
    table = (held if jumps else broken_line)(knots, np.column_stack([course, 0.0 * course]))
    times = np.linspace(0.0, 2.0, 201)
    reference, x = [np.zeros(2)], np.zeros(2)
    for j, start in enumerate(knots):

        def rhs(t: float, x: Array, j: int = j, start: float = start) -> list[float]:
            e = table.values[j, 0] + table.slopes[j, 0] * (t - start) - x[0]
            z = k * e + x[1]
            hold = np.clip(1.0 - (abs(z) - limit) / band, 0.0, 1.0)
            return [(np.clip(z, -limit, limit) - x[0]) / tau, ki * e * hold]

        stop = knots[j + 1] if j + 1 < len(knots) else 2.0
        inside = times[(times > start + 1e-12) & (times < stop - 1e-12)]
        solved = solve_ivp(
            rhs, (start, stop), x, "Radau", [*inside, stop], rtol=1e-9, atol=1e-11, max_step=1e-3
        )
        reference.extend(solved.y.T)
        x = solved.y[:, -1]
    with Fmi2("saturation", logging=True) as fmu:
        found = follow(fmu.start(), times, [fmu.refs.x, fmu.refs.x + 1], table)
        assert 4 <= fmu.events() <= 20
    assert np.abs(found.rows - np.array(reference)).max() < 1e-5 * np.ptp(reference)


@pytest.mark.parametrize("excess", [0.0, 1e-8, 1e-4, 0.25])
@pytest.mark.parametrize("count", [2, 3, 9, 501])
def test_excursions_are_found_between_and_at_samples(excess: float, count: int) -> None:
    """g = a - (t - 1)^2 > 0 adds 4/3 a^1.5; with a = 0.25 both events lie at samples of the finer grids."""
    times = np.linspace(0.0, 2.0, count)
    away = np.clip(times - 1.0, -np.sqrt(excess), np.sqrt(excess))
    gained = excess * (away + np.sqrt(excess)) - (away**3 + excess**1.5) / 3.0
    with Fmi2("kink", logging=True) as fmu:
        fmu.set([fmu.refs.p], [excess])
        found = follow(fmu.start(), times, [fmu.refs.x])
        assert fmu.events() == (2 if excess > 0.0 else 0)
    np.testing.assert_allclose(found.rows[:, 0], times + gained, atol=2e-9)


def test_one_time_gives_the_initial_values(version: type[Fmu]) -> None:
    with version("linear") as fmu:
        found = follow(
            fmu.start(start=2.0), np.array([2.0]), [0, fmu.refs.x], NOTHING._replace(starts=np.array([2.0]))
        )
    assert found.status == OK
    np.testing.assert_array_equal(found.rows, [[2.0, 1.0]])


def test_a_jump_at_the_last_time_shows_in_the_last_row() -> None:
    times = np.array([0.0, 0.5, 1.0])
    with Fmi2("linear") as fmu:
        table = held(np.array([0.0, 1.0]), np.array([[0.0, 0.0], [7.0, 0.0]]))
        found = follow(fmu.start(), times, [fmu.refs.u, fmu.refs.w + 1, fmu.refs.x + 1], table)
    assert found.rows[:, 0].tolist() == [0.0, 0.0, 7.0]
    assert found.rows[-1, 1] == pytest.approx(found.rows[-1, 2] + 7.0 + np.sin(1.0), rel=1e-12)


def test_every_kind_of_variable_can_be_recorded() -> None:
    times = np.linspace(0.0, 1.0, 5)
    with Fmi2("stickslip") as fmu:
        r = fmu.refs
        wanted = [0, r.x, r.dx + 1, r.u, r.p + 1, r.w, r.w + 2, r.g]
        found = follow(fmu.start(), times, wanted, held(np.zeros(1), np.array([[0.05, 0.0]])))
    with Fmi2("stickslip") as fmu:
        fmu.set([r.u], [0.05])
        stepped = run(fmu.start(), times, wanted)
    np.testing.assert_allclose(found.rows, stepped, rtol=2e-4, atol=1e-7)


def test_a_failure_says_when_and_why_and_keeps_the_rows_before_it(version: type[Fmu]) -> None:
    times = np.linspace(0.0, 2.0, 21)
    with version("runaway") as fmu:
        found = follow(fmu.start(), times, [fmu.refs.x])
        assert found.status == DISCARD
        assert "at time" in fmu.log[-1][2]
        done = found.report.done
        assert 0.9 <= found.report.reached <= 1.0
        assert 10 <= done <= 11
    exact = times[:done] + 2.0 / 3.0 * (1.0 - (1.0 - times[:done]).clip(0.0) ** 1.5)
    np.testing.assert_allclose(found.rows[:done, 0], exact, atol=1e-5)
    assert np.isnan(found.rows[done:]).all()


TIMES = np.linspace(0.0, 1.0, 3)
WRONG = {
    "outputs": (np.array([999], dtype=np.uint32), "reads what is no variable"),
    "inputs": (np.array([1, 2], dtype=np.uint32), "drives what is no input"),
    "times": (np.array([0.0, 0.6, 0.5]), "do not increase"),
    "starts": (np.array([0.0, 0.0, 0.0, 0.0, 0.0]), "do not follow each other"),
    "values": (np.full((5, 2), np.inf), "not finite"),
}


@pytest.mark.parametrize("field", WRONG)
def test_what_makes_no_sense_is_refused_with_a_reason(version: type[Fmu], field: str) -> None:
    array, says = WRONG[field]
    with version("linear") as fmu:
        found = follow(fmu.start(), TIMES, [fmu.refs.x], broken_line(KNOTS, COURSE), {field: array})
        assert found.status == ERROR
        assert says in fmu.log[-1][2]
        assert follow(fmu, TIMES, [fmu.refs.x]).status == OK  # nothing has happened to the instance


def test_it_has_its_place_in_the_state_machine(version: type[Fmu]) -> None:
    with version("linear") as fmu:
        assert follow(fmu, TIMES, [fmu.refs.x]).status == ERROR
        fmu.start(start=1.0)
        assert follow(fmu, TIMES, [fmu.refs.x]).status == ERROR  # not the present time
    with version("linear", kind="me") as fmu:
        fmu.start()
        assert follow(fmu, TIMES, [fmu.refs.x]).status == ERROR
    with version("linear") as fmu:
        fmu.start()
        first = follow(fmu, TIMES, [fmu.refs.x]).rows
        fmu.step(1.0, 0.5)  # and ordinary steps go on from where it ended
        assert fmu.get([0])[0] == 1.5
        assert first[-1, 0] != fmu.get([fmu.refs.x])[0]


@st.composite
def tables(draw: st.DrawFn) -> tuple[Table, Array, bool]:
    lengths = draw(st.lists(st.integers(1, 200), min_size=1, max_size=8))
    knots = np.concatenate(([0.0], np.cumsum(lengths[:-1]))) * 1e-2
    values = st.floats(-2.5, 2.5).map(lambda v: round(v, 3))
    pairs = st.lists(st.tuples(values, values), min_size=len(knots), max_size=len(knots))
    course = np.array(draw(pairs))
    jumps = draw(st.booleans())
    table = held(knots, course) if jumps else broken_line(knots, course)
    times = np.arange(int(draw(st.integers(2, 400)))) * draw(st.sampled_from([1e-2, 5e-3, 2e-2]))
    return table, times, jumps


@settings(max_examples=40, deadline=None)
@given(drawn=tables())
def test_random_inputs_give_what_steps_from_sample_to_sample_give(drawn: tuple[Table, Array, bool]) -> None:
    """Every knot is a multiple of 0.01 s, so that a grid of 5 ms has them all among its communication points."""
    table, times, _ = drawn

    def inputs(time: float, after: bool) -> Array:
        at = np.searchsorted(table.starts, time + (1e-9 if after else -1e-9), side="right") - 1
        return table.values[at] + table.slopes[at] * (time - table.starts[at])

    with Fmi2("saturation") as fmu:
        fmu.set([fmu.refs.u, fmu.refs.u + 1], table.values[0])
        found = follow(fmu.start(tolerance=1e-8), times, [fmu.refs.x, fmu.refs.x + 1], table)
        assert found.status == OK
    with Fmi2("saturation") as fmu:
        u, x = [fmu.refs.u, fmu.refs.u + 1], [fmu.refs.x, fmu.refs.x + 1]
        fmu.set(u, table.values[0])
        fmu.start(tolerance=1e-8)
        rows = [fmu.get(x)]
        for k in range(round(times[-1] / 5e-3)):
            begin, end = 5e-3 * k, 5e-3 * (k + 1)
            fmu.set(u, inputs(begin, after=True))
            fmu.slopes(u, (inputs(end, after=False) - inputs(begin, after=True)) / 5e-3)
            fmu.step(begin, 5e-3)
            rows.append(fmu.get(x))
    stepped = np.array(rows)[np.round(times / 5e-3).astype(int)]
    assert np.abs(found.rows - stepped).max() < 3e-6


def test_fmi3_callbacks_are_left_alone() -> None:
    calls: list[float] = []
    with Fmi3("linear", update=lambda _f, time, *_: calls.append(time), required=[1, 7]) as fmu:
        assert follow(fmu.start(), TIMES, [fmu.refs.x]).status == OK
        assert calls == []
        fmu.step(1.0, 0.5)
        assert calls


def test_fmi3_returns_early_where_it_is_asked_to() -> None:
    seen: list[float] = []

    def update(_fmu: Fmi3, time: float, *_: bool) -> bool:
        seen.append(time)
        return len(seen) == 3

    with Fmi3("linear", update=update, required=[1], early_return=True) as fmu:
        fmu.start()
        early, reached = fmu.do_step(0.0, 2.0)
        assert early
        assert reached == seen[-1] == fmu.get([0])[0]
        assert len(seen) == 3
        early, reached = fmu.do_step(reached, 2.0 - reached)
        assert not early
        assert reached == 2.0
        x = fmu.get([fmu.refs.x])[0]
    assert x == pytest.approx(np.exp(-1.0), rel=1e-5)
    with Fmi3("linear", update=lambda *_: True, required=[1]) as fmu:  # not allowed at instantiation
        assert fmu.start().do_step(0.0, 2.0) == (False, 2.0)
