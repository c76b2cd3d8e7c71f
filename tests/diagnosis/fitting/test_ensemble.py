"""Gauss-Newton by an ensemble: optima of smooth and of rugged residuals, bounds, and what fails."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from scipy.optimize import least_squares

from thsa_cosim.diagnosis.fitting.ensemble import PATIENCE, ROUNDS, descent

ROWS = np.random.default_rng(2).standard_normal((200, 4))
TRUE = np.array([1.0, -2.0, 0.5, 3.0])
START = np.array([0.6, -1.2, 0.9, 2.2])
SPREADS = np.full(4, 0.5)


NOISE = 0.1 * np.random.default_rng(3).standard_normal(200)


def linear(x: np.ndarray) -> np.ndarray:
    return np.asarray(ROWS @ (x - TRUE) + NOISE)


def rugged(x: np.ndarray) -> np.ndarray:
    """Events at the rows' own places fall to one side or the other: slopes of small steps are not those of large."""
    off = ROWS @ (x - TRUE)
    return np.asarray(off + 0.15 * np.sin(60.0 * off))


def free(x: np.ndarray) -> np.ndarray:
    return x


def run(
    residuals: Callable[[np.ndarray], np.ndarray | None],
    start: np.ndarray = START,
    spreads: np.ndarray = SPREADS,
    clip: Callable[[np.ndarray], np.ndarray] = free,
    seed: int = 1,
) -> list[tuple[np.ndarray, float]]:
    def each(vectors: np.ndarray) -> Sequence[np.ndarray | None]:
        return [residuals(v) for v in vectors]

    return list(descent(each, start, spreads, clip, seed))


def test_a_linear_optimum_is_found_and_the_cost_never_rises():
    rounds = run(linear)
    costs = [cost for _, cost in rounds]
    assert costs == sorted(costs, reverse=True)
    least = np.linalg.lstsq(ROWS, ROWS @ TRUE - NOISE, rcond=None)[0]
    assert rounds[-1][0] == pytest.approx(least, abs=2e-3)
    assert PATIENCE < len(rounds) <= ROUNDS


def test_rugged_residuals_do_not_hold_it_up_as_they_do_small_differences():
    stopped = least_squares(rugged, START)
    assert np.max(np.abs(stopped.x - TRUE)) > 0.1, "else the test shows nothing"
    for seed in (1, 2, 3):
        assert run(rugged, seed=seed)[-1][0] == pytest.approx(TRUE, abs=0.05)


def test_what_has_no_spread_stays_and_bounds_are_kept():
    spreads = np.array([0.5, 0.0, 0.5, 0.5])
    upper = np.array([0.8, 9.0, 9.0, 9.0])
    seen: list[np.ndarray] = []

    def residuals(x: np.ndarray) -> np.ndarray:
        seen.append(x)
        return linear(x)

    found, cost = run(residuals, spreads=spreads, clip=lambda x: np.minimum(x, upper))[-1]
    assert all(x[1] == START[1] for x in seen)
    assert all((x <= upper).all() for x in seen)
    held = np.array([0.8, START[1]])
    rest = np.linalg.lstsq(ROWS[:, 2:], ROWS @ TRUE - NOISE - ROWS[:, :2] @ held, rcond=None)[0]
    assert found[0] == pytest.approx(0.8)
    assert cost == pytest.approx(float(np.sum(linear(np.concatenate([held, rest])) ** 2)), rel=0.01)


def test_members_that_fail_are_left_out():
    found = run(lambda x: None if x[0] > 1.2 else linear(x))[-1][0]
    assert found == pytest.approx(run(linear)[-1][0], abs=5e-3)


def test_where_the_start_fails_or_nothing_moves_there_is_nothing():
    assert run(lambda _x: None) == []
    assert run(linear, spreads=np.zeros(4)) == []


def test_the_seed_decides():
    assert [c for _, c in run(rugged)] == [c for _, c in run(rugged)]
    assert [c for _, c in run(rugged)] != [c for _, c in run(rugged, seed=2)]


def test_a_start_that_leaves_nothing_is_the_end():
    ((found, cost),) = run(lambda x: ROWS @ (x - TRUE), start=TRUE)
    assert cost == 0.0
    assert found == pytest.approx(TRUE)


def test_a_long_narrow_valley_is_gone_along_ever_faster():
    """The end is 500 spreads away, and a step reaches 2: steps that are tried again, and 3 times, get there."""

    def valley(x: np.ndarray) -> np.ndarray:
        return np.array([x[0] - 10.0, 30.0 * (x[1] - x[0]), x[2] - 1.0, 0.5])

    found, cost = run(valley, start=np.zeros(3), spreads=np.full(3, 0.02))[-1]
    assert found == pytest.approx([10.0, 10.0, 1.0], abs=0.05)
    assert cost == pytest.approx(0.25, rel=0.02)
