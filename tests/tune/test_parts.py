"""Pieces of tuning against closed forms, brute force and independent tools."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thsa_cosim.costs import control_cost
from thsa_cosim.scenario.tune_model import CovariancePoint, Requirement
from thsa_cosim.search import EvolutionSettings, evolve
from thsa_cosim.tune.combine import INFEASIBLE, UNDEFINED, combine, worst_of
from thsa_cosim.tune.margins import FREQUENCIES, margins_by_control, margins_of
from thsa_cosim.tune.pareto import front
from thsa_cosim.tune.population import PopulationPath, line_of
from thsa_cosim.tune.samples import deviations
from thsa_cosim.tune.schedule import GainSchedule, smooth

NAMES = ("tracking", "rise_time", "steady_state_error", "overshoot", "phase_margin")


class Spec:
    """As much of a scenario as combining needs."""

    def __init__(self, combine: str = "worst", signed: bool = False) -> None:
        self.combine = combine
        self.cost = type("Cost", (), {"kappa_rise": 10.0, "kappa_steady": 100.0, "signed": signed})()


def limit(
    metric: str, value: float, upper: bool = True, hard: bool = True, penalty: float = 1.0
) -> Requirement:
    given = {"maximum" if upper else "minimum": value, "unit": "1", "limit": value, "scale": 0.01}
    return Requirement.model_construct(metric=metric, hard=hard, penalty=penalty, **given)


# one row per condition: J = 1 + 10·0.3 + 100·|-0.02| = 6 and 3 + 4 + 1 = 8
TERMS = np.array([[1.0, 0.3, -0.02, 0.0, 70.0], [3.0, 0.4, 0.01, 0.015, 65.0]])


def test_equation_7_counts_the_error_by_its_size_and_signed_only_when_asked() -> None:
    time = np.linspace(0.0, 2.0, 2001)
    command = np.ones_like(time)
    fast = 1.0 - np.exp(-time / 0.1) + 0.05 * (time > 1.0)
    options = {"kappa_rise": 2.0, "kappa_steady": 100.0, "window": (1.5, 2.0)}
    plain, signed = (
        control_cost(time, fast, command, **options),
        control_cost(time, fast, command, signed=True, **options),
    )
    assert plain.steady_state_error == pytest.approx(-0.05, abs=1e-6)
    assert plain.total - signed.total == pytest.approx(2 * 100.0 * 0.05, abs=1e-3)
    between = control_cost(time, fast, command, low=0.1, fraction=0.9, **options)
    assert between.rise_time == pytest.approx(0.1 * np.log(9.0), rel=1e-4)
    assert plain.rise_time == pytest.approx(0.1 * np.log(20.0), rel=1e-4)


def test_conditions_combine_by_the_worst_or_by_weight() -> None:
    ones = np.ones(2)
    assert combine(Spec(), NAMES, TERMS, ones, ()).cost == pytest.approx(8.0)
    assert combine(Spec("sum"), NAMES, TERMS, np.array([3.0, 1.0]), ()).cost == pytest.approx((3 * 6 + 8) / 4)
    assert combine(Spec("worst", signed=True), NAMES, TERMS[:1], ones[:1], ()).cost == pytest.approx(2.0)
    assert worst_of(NAMES, TERMS).tolist() == [3.0, 0.4, -0.02, 0.015, 65.0]


def test_hard_limits_outrank_every_cost_and_soft_ones_add() -> None:
    ones = np.ones(2)
    hard = combine(Spec(), NAMES, TERMS, ones, [limit("overshoot", 0.005)])
    assert not hard.feasible
    assert hard.cost == pytest.approx(INFEASIBLE * 2.0)
    nearer = combine(Spec(), NAMES, TERMS, ones, [limit("overshoot", 0.014)])
    assert INFEASIBLE < nearer.cost < hard.cost
    soft = combine(Spec(), NAMES, TERMS, ones, [limit("overshoot", 0.005, hard=False, penalty=7.0)])
    assert soft.feasible
    assert soft.cost == pytest.approx(8.0 + 7.0)
    assert soft.eq7 == pytest.approx(8.0)
    margin = combine(Spec(), NAMES, TERMS, ones, [limit("phase_margin", 66.0, upper=False)])
    assert margin.excess.tolist() == pytest.approx([100.0])
    assert combine(Spec(), NAMES, TERMS, ones, [limit("steady_state_error", 0.02)]).feasible
    assert not combine(Spec(), NAMES, TERMS, ones, [limit("steady_state_error", 0.019)]).feasible


def test_an_undefined_metric_is_the_worst_one() -> None:
    broken = TERMS.copy()
    broken[1, 1] = np.nan  # never reached its level
    found = combine(Spec(), NAMES, broken, np.ones(2), [limit("rise_time", 0.5)])
    assert found.cost == pytest.approx(INFEASIBLE * (1.0 + UNDEFINED))
    assert combine(Spec(), NAMES, broken, np.ones(2), ()).cost == np.inf
    assert np.isnan(found.worst[1])


def test_reserve_moves_limits_inwards() -> None:
    assert limit("overshoot", 0.01).tightened(0.1).limit == pytest.approx(0.009)
    assert limit("phase_margin", 60.0, upper=False).tightened(0.1).limit == pytest.approx(66.0)


def integrator(gain: float, lag: float) -> np.ndarray:
    s = 1j * FREQUENCIES
    return gain / (s * (1.0 + lag * s))


def test_margins_meet_closed_forms() -> None:
    # k/(s (1 + T s)), kT = 1/2 (damping 1/√2): ω_c T = √((√2 - 1)/2), PM = 90° - atan(ω_c T) = 65.53°
    found = margins_of(FREQUENCIES, integrator(10.0, 0.05))
    wct = np.sqrt((np.sqrt(2.0) - 1.0) / 2.0)
    assert found.phase_margin == pytest.approx(90.0 - np.degrees(np.arctan(wct)), abs=0.05)
    assert found.gain_margin == np.inf
    assert found.bandwidth == pytest.approx(10.0 * np.sqrt(2.0) / (2 * np.pi), rel=2e-3)  # ω_n = √(k/T)
    # 4/(s + 1)³ crosses -180° at √3 with |L| = 1/2.
    third = margins_of(FREQUENCIES, 4.0 / (1j * FREQUENCIES + 1.0) ** 3)
    assert third.gain_margin == pytest.approx(20 * np.log10(2.0), abs=0.01)
    # The unstable plant 2/(s - 1) with gain 1: its gain may fall by 2 before the loop fails (at ω = 0 only).
    assert margins_of(FREQUENCIES, 2.0 / (1j * FREQUENCIES - 1.0)).phase_margin == pytest.approx(
        60.0, abs=0.05
    )


@pytest.mark.parametrize("gain", [0.5, 3.0, 20.0])
def test_margins_agree_with_python_control(gain: float) -> None:
    pytest.importorskip("control")
    s = 1j * FREQUENCIES
    response = gain * (1.0 + 0.5 * s) / (s * (1.0 + 0.1 * s) * (1.0 + 0.01 * s) ** 2)
    ours, theirs = margins_of(FREQUENCIES, response), margins_by_control(FREQUENCIES, response)
    assert ours.phase_margin == pytest.approx(theirs.phase_margin, abs=0.1)
    assert ours.gain_margin == pytest.approx(theirs.gain_margin, abs=0.05)


def test_the_path_is_the_population_of_the_search() -> None:
    path = PopulationPath()

    def valley(vectors: np.ndarray) -> np.ndarray:
        costs = np.sum((vectors - [0.3, 0.7]) ** 2, axis=1)
        costs[vectors[:, 0] > 0.9] = np.nan
        path.add(vectors, costs)
        return costs

    found = evolve(valley, 2, EvolutionSettings(population=12, generations=8, tolerance=0.0))
    assert len(path.populations) == len(found.history) == 9
    for population, costs, generation in zip(path.populations, path.costs, found.history, strict=True):
        assert costs.min() == generation.best_cost
        assert np.std(population, axis=0) == pytest.approx(generation.spread)
    assert np.array_equal(path.populations[-1], found.population)


def test_the_line_is_the_ratio_of_the_last_generations() -> None:
    path = PopulationPath()
    scattered = np.array([[1.0, 1.0], [5.0, 1.0], [2.0, 9.0]])
    lined = np.array([[1.0, 8.0], [2.0, 16.0], [3.0, 24.0]])
    path.add(scattered, np.array([3.0, 4.0, 5.0]))
    path.add(lined, np.array([1.0, 2.0, 3.0]))
    line = line_of(path, ("K_p", 0), ("K_i", 1), 1, 0.1218)
    assert line is not None
    assert (line.ratio, line.low, line.high, line.generations) == (0.125, 0.125, 0.125, 1)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=1, max_size=30))
def test_the_front_holds_what_nothing_beats(points: list[tuple[int, int]]) -> None:
    x, y = (np.array(c, dtype=float) for c in zip(*points, strict=True))
    chosen = front(x, y)
    beaten = [
        any((x[j] <= x[k] and y[j] <= y[k]) and (x[j] < x[k] or y[j] < y[k]) for j in range(len(x)))
        for k in range(len(x))
    ]
    best = {(x[k], y[k]) for k in range(len(x)) if not beaten[k]}
    assert [(x[k], y[k]) for k in chosen] == sorted(best)


def test_smoothing_keeps_straight_lines_and_ends_at_one() -> None:
    nodes = np.array([-55.0, -40.0, -25.0, 0.0, 25.0])
    line = 0.3 + 0.01 * nodes
    assert smooth(line, [nodes], 1e3) == pytest.approx(line)
    rough = line + np.array([0.1, -0.2, 0.1, 0.0, 0.05])
    strong = smooth(rough, [nodes], 1e9)
    assert strong == pytest.approx(np.polyval(np.polyfit(nodes, rough, 1), nodes), abs=1e-5)
    assert smooth(rough, [nodes], 0.0) == pytest.approx(rough)
    bends = [_bend(nodes, smooth(rough, [nodes], s)) for s in (0.0, 0.1, 1.0, 10.0)]
    assert bends == sorted(bends, reverse=True)
    assert bends[3] < 0.5 * bends[0]
    plane = nodes[:, None] * 0.01 + np.array([0.0, 27.5, 55.0]) * 0.02
    assert smooth(plane, [nodes, np.array([0.0, 27.5, 55.0])], 50.0) == pytest.approx(plane)


def _bend(x: np.ndarray, y: np.ndarray) -> float:
    return float(np.sum((np.diff(np.diff(y) / np.diff(x)) / (x[2:] - x[:-2])) ** 2))


def table() -> GainSchedule:
    nodes = (np.array([-55.0, 0.0, 25.0]), np.array([-55.0, 55.0]))
    gains = {"K_p": np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 8.0]])}
    return GainSchedule(("T", "F"), ("degC", "kN"), nodes, gains, {"K_p": "1"})


def test_a_schedule_is_bilinear_and_held_beyond_its_ends() -> None:
    schedule = table()
    assert schedule.at({"T": -27.5, "F": 0.0})["K_p"] == pytest.approx((1 + 2 + 3 + 4) / 4)
    assert schedule.at({"T": 99.0, "F": 99.0})["K_p"] == 8.0
    assert schedule.points()[3] == {"T": 0.0, "F": 55.0, "K_p": 4.0}


def test_samples_have_the_covariance_of_the_identification() -> None:
    correlation = np.array([[1.0, 0.8], [0.8, 1.0]])
    point = CovariancePoint(-30.0, np.array([2.0, 0.1]), correlation)
    drawn = deviations(point, np.random.default_rng(1).standard_normal((200_000, 2)))
    assert np.cov(drawn.T) == pytest.approx(np.array([[4.0, 0.16], [0.16, 0.01]]), rel=0.02)
    exact = deviations(dataclasses.replace(point, stderr=np.zeros(2)), np.ones((1, 2)))
    assert exact.tolist() == [[0.0, 0.0]]
