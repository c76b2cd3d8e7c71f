"""Least squares against closed forms and SciPy's; local searches that agree, and that do not."""

import numpy as np
import pytest
import scipy.optimize

from thsa_cosim.search import (
    Box,
    DifferenceSettings,
    LeastSquaresSettings,
    LocalSettings,
    Prior,
    agreement,
    answer,
    difference_columns,
    least_squares,
    search_locally,
)

TIME = np.linspace(0.0, 10.0, 500)
TRUE = np.array([0.5, 0.3, 0.4])
NOISE = 0.02 * np.random.default_rng(1).normal(size=TIME.size)
TIGHT = LeastSquaresSettings(enough=1e-9)


def decay(u: np.ndarray) -> np.ndarray:
    return u[0] * np.exp(-3.0 * u[1] * TIME) + u[2] * np.sign(np.sin(TIME))


def misfit(u: np.ndarray) -> np.ndarray:
    return (decay(u) - decay(TRUE) - NOISE) / 0.02


def batch(vectors: np.ndarray) -> list[np.ndarray]:
    return [misfit(u) for u in vectors]


@pytest.mark.parametrize("error", ["squared", "huber", "absolute"])
def test_the_minimum_is_scipys(error: str) -> None:
    residual = lambda u: misfit(u) + np.where(np.arange(TIME.size) % 37 == 0, 20.0, 0.0)  # noqa: E731
    loss, width = {"squared": ("linear", 1.0), "huber": ("huber", 1.345), "absolute": ("soft_l1", 0.1)}[error]
    wanted = scipy.optimize.least_squares(
        residual, [0.4, 0.4, 0.5], bounds=(0, 1), loss=loss, f_scale=width, xtol=1e-12, ftol=1e-14, gtol=1e-12
    )
    settings = LeastSquaresSettings(
        enough=1e-8, error=error, differences=DifferenceSettings(central=True, share=0.0)
    )
    search = least_squares(np.array([0.9, 0.9, 0.1]), Box.unit(3), settings)
    found = answer(search, lambda vectors: [residual(u) for u in vectors])
    assert found is not None
    np.testing.assert_allclose(found.x, wanted.x, atol=5e-5)  # a hundredth of a standard error
    assert found.history[-1] == pytest.approx(2.0 * wanted.cost, rel=1e-7)
    assert list(found.history) == sorted(found.history, reverse=True)


def test_minima_on_bounds_are_those_of_bounded_linear_least_squares() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        matrix, target = rng.normal(size=(30, 5)), 2.0 * rng.normal(size=30)
        wanted = scipy.optimize.lsq_linear(matrix, target, bounds=(0, 1), tol=1e-14)
        search = least_squares(rng.random(5), Box.unit(5), TIGHT)
        found = answer(search, lambda v, m=matrix, t=target: [m @ u - t for u in v])
        assert found is not None
        np.testing.assert_allclose(found.x, wanted.x, atol=1e-5)


def test_a_prior_gives_the_ridge_solution_in_units_of_its_own() -> None:
    rng = np.random.default_rng(4)
    matrix, target = rng.normal(size=(40, 3)), rng.normal(size=40)
    mean, precision = np.array([100.0, -200.0, 0.0]), np.array([2.0, 0.0, 5.0])
    box = Box(np.full(3, -1e6), np.full(3, 1e6), np.array([100.0, 10.0, 1.0]))
    search = least_squares(np.zeros(3), box, TIGHT, prior=Prior(mean, precision))
    found = answer(search, lambda v: [matrix @ u - target for u in v])
    wanted = np.linalg.solve(
        matrix.T @ matrix + np.diag(precision**2), matrix.T @ target + precision**2 * mean
    )
    assert found is not None
    np.testing.assert_allclose(found.x, wanted, rtol=1e-5, atol=1e-4)
    np.testing.assert_allclose(found.jacobian, matrix * box.scale, rtol=1e-5, atol=1e-4)


def test_kept_columns_are_not_asked_for_again() -> None:
    rng = np.random.default_rng(5)
    matrix, target = rng.normal(size=(30, 4)), rng.normal(size=30)
    moved = []

    def evaluate(vectors: np.ndarray) -> list[np.ndarray]:
        if len(vectors) == 2:
            moved.extend(np.flatnonzero(v - vectors.min(axis=0)).tolist() for v in vectors)
        return [matrix @ u + 0.1 * np.sin(matrix @ u) - target for u in vectors]

    start = np.full(4, 0.5)
    residual = evaluate(start[None, :])[0]
    search = least_squares(start, Box.unit(4), TIGHT, residual=residual, jacobian=matrix.copy(), fresh=[1, 3])
    found = answer(search, evaluate)
    assert found is not None
    assert len(found.history) > 2
    assert {tuple(m) for m in moved} <= {(1,), (3,)}
    assert moved


def test_columns_are_taken_towards_the_inside_and_failed_ones_are_zero() -> None:
    def evaluate(vectors: np.ndarray) -> list[np.ndarray | None]:
        assert (vectors >= 0.0).all()
        assert (vectors <= 1.0).all()
        return [None if u[1] != 0.5 else np.array([3.0 * u[0], u[2] ** 2, u[0]]) for u in vectors]

    x = np.array([1.0, 0.5, 0.0])
    centre = evaluate(x[None, :])[0]
    found, steps = answer(
        difference_columns(x, centre, np.full(3, 1e-4), Box.unit(3), DifferenceSettings()), evaluate
    )
    np.testing.assert_allclose(found[:, 0], [3.0, 0.0, 1.0])
    np.testing.assert_array_equal(found[:, 1], 0.0)
    np.testing.assert_allclose(found[:, 2], [0.0, 1e-4, 0.0])
    assert steps[1] < 1e-4


def test_searches_from_spread_starts_agree_on_the_one_minimum_and_share_batches() -> None:
    sizes = []

    def evaluate(vectors: np.ndarray) -> list[np.ndarray]:
        sizes.append(len(vectors))
        return batch(vectors)

    found = search_locally(evaluate, 3, LocalSettings())
    assert found is not None
    assert found.settled
    assert agreement(found.searches) == "3 of 3 local searches from different starts agree"
    assert found.evaluations == sum(sizes)
    assert sizes[0] == 12  # three hands of four
    starts = np.array([search.start for search in found.searches])
    assert np.min(np.ptp(starts, axis=0)) > 0.05
    wanted = scipy.optimize.least_squares(misfit, TRUE).x
    np.testing.assert_allclose(found.minimum.x, wanted, atol=1e-4)


def test_a_seed_fixes_every_vector() -> None:
    def trail(seed: int) -> np.ndarray:
        seen: list[np.ndarray] = []
        search_locally(lambda v: (seen.append(v.copy()), batch(v))[1], 3, LocalSettings(seed=seed))
        return np.concatenate(seen)

    np.testing.assert_array_equal(trail(7), trail(7))
    assert not np.array_equal(trail(7)[:12], trail(8)[:12])


def test_searches_that_end_apart_are_counted_and_do_not_settle_it() -> None:
    """A sine's frequency has a minimum for every turn that is gained or lost."""
    measured = np.sin(2.0 * np.pi * 0.55 * 5.0 * TIME)

    def evaluate(vectors: np.ndarray) -> list[np.ndarray]:
        return [(u[1] * np.sin(2.0 * np.pi * u[0] * 5.0 * TIME) - measured) / 0.01 for u in vectors]

    found = search_locally(evaluate, 2, LocalSettings(hand=1))
    assert found is not None
    assert not found.settled
    assert len(found.searches) == 8
    assert found.agreed < 4
    assert found.minimum.cost == min(search.cost for search in found.searches)


def test_a_better_minimum_of_a_global_search_is_what_the_others_are_compared_with() -> None:
    """Minima near 0.2 and at 0.9, of which the local searches can only reach the first."""

    def wells(u: np.ndarray) -> np.ndarray:
        return np.array([30.0 * (u[0] - 0.2) * (u[0] - 0.9), u[0] - 0.9])

    found = search_locally(lambda v: [wells(u) if u[0] < 0.5 else None for u in v], 1, LocalSettings())
    assert found is not None
    assert (found.settled, found.agreed) == (True, 3)
    other = answer(least_squares(np.array([0.8]), Box.unit(1), TIGHT), lambda v: [wells(u) for u in v])
    assert other is not None
    both = found.with_minimum(other, "squared")
    assert both.minimum.x[0] == pytest.approx(0.9)
    assert agreement(both.searches) == "0 of 3 local searches from different starts agree"
    assert other.cost < found.minimum.cost
    assert found.with_minimum(found.minima[1], "squared").agreed == 3


def test_where_only_part_of_the_cube_can_be_simulated_the_starts_lie_there() -> None:
    def evaluate(vectors: np.ndarray) -> list[np.ndarray | None]:
        return [None if u[0] > 0.6 else misfit(u) for u in vectors]

    found = search_locally(evaluate, 3, LocalSettings())
    assert found is not None
    assert found.settled
    assert all(search.start[0] <= 0.6 for search in found.searches)


def test_nothing_that_can_be_simulated_is_no_result_and_costs_little() -> None:
    count = 0

    def evaluate(vectors: np.ndarray) -> list[None]:
        nonlocal count
        count += len(vectors)
        return [None] * len(vectors)

    assert search_locally(evaluate, 3, LocalSettings()) is None
    assert count == 12


def test_a_given_start_is_the_first() -> None:
    start = np.array([0.45, 0.35, 0.5])
    found = search_locally(batch, 3, LocalSettings(), start=start)
    assert found is not None
    np.testing.assert_array_equal(found.searches[0].start, start)


def test_parameters_without_effect_do_not_keep_searches_from_agreeing() -> None:
    found = search_locally(lambda v: [misfit(u[:3]) for u in v], 4, LocalSettings())
    assert found is not None
    assert found.settled
