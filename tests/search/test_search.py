"""Evolution, polish and uncertainty on problems whose answers are known."""

import numpy as np
import pytest
from scipy.signal import lfilter

from thsa_cosim.search import (
    CHI2_95,
    STRATEGIES,
    EvolutionSettings,
    Generation,
    PolishSettings,
    estimate_uncertainty,
    evolve,
    long_run_covariance,
    polish,
    profile,
    with_given,
)
from thsa_cosim.search.uncertainty import SOLVER_NOISE, Uncertainty

TIME = np.linspace(0.0, 10.0, 2000)
TRUE = np.array([0.5, 0.3, 0.4])


def bowl(vectors: np.ndarray) -> np.ndarray:
    return np.sum((vectors - [0.2, 0.5, 0.8]) ** 2 * [1.0, 10.0, 100.0], axis=1)


def decay(u: np.ndarray) -> np.ndarray:
    return u[0] * np.exp(-u[1] * TIME) + u[2] * np.sign(np.sin(TIME))


def noise(seed: int, rho: float = 0.0) -> np.ndarray:
    white = np.random.default_rng(seed).normal(size=TIME.size)
    return lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white)


def fitted(model, measured, start=(0.4, 0.4, 0.5), error="squared", sigma=0.1, groups=None):
    result = polish(
        lambda vectors: [(model(u) - measured) / sigma for u in vectors],
        np.array(start),
        PolishSettings(error=error),
    )
    groups = groups or [[slice(0, measured.size)]]
    names = ["a", "b", "c"][: len(start)]
    return result, estimate_uncertainty(
        result.best, result.residual, result.jacobian, result.jacobian_error, groups, names, error
    )


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_every_strategy_closes_in_on_the_minimum(strategy: str) -> None:
    settings = EvolutionSettings(
        strategy=strategy, generations=60, mutation=0.5, crossover=0.9, tolerance=0.0
    )
    result = evolve(bowl, 3, settings)
    np.testing.assert_allclose(result.best, [0.2, 0.5, 0.8], atol=0.05)
    assert result.cost == bowl(result.best[None])[0]


def test_the_published_setting_is_the_default_and_counts_right() -> None:
    batches = []

    def evaluate(vectors: np.ndarray) -> np.ndarray:
        batches.append(vectors.shape)
        return bowl(vectors)

    seen: list[Generation] = []
    result = evolve(evaluate, 3, EvolutionSettings(tolerance=0.0), on_generation=seen.append)
    assert batches == [(45, 3)] * 31
    assert result.evaluations == 45 * 31
    assert [g.index for g in seen] == list(range(31))
    assert [g.evaluations for g in seen] == [45 * (k + 1) for k in range(31)]
    assert result.population.shape == (45, 3)
    assert result.reason == "all 30 generations were used"
    assert not result.converged
    best = [g.best_cost for g in seen]
    assert best == sorted(best, reverse=True)


def test_a_seed_fixes_every_vector_and_another_seed_changes_them() -> None:
    def trail(seed: int) -> np.ndarray:
        vectors = []
        evolve(
            lambda v: (vectors.append(v.copy()), bowl(v))[1], 3, EvolutionSettings(seed=seed, generations=5)
        )
        return np.concatenate(vectors)

    np.testing.assert_array_equal(trail(7), trail(7))
    assert not np.array_equal(trail(7), trail(8))


def test_proposals_stay_in_the_cube_and_a_start_takes_part() -> None:
    batches = []
    start = np.array([0.2, 0.5, 0.8])
    result = evolve(
        lambda v: (batches.append(v.copy()), bowl(v))[1],
        3,
        EvolutionSettings(generations=3, mutation=1.9),
        start=start,
    )
    assert all((batch >= 0.0).all() and (batch <= 1.0).all() for batch in batches)
    np.testing.assert_array_equal(batches[0][0], start)
    assert result.cost == 0.0


def test_the_initial_population_is_a_latin_hypercube() -> None:
    first = []
    evolve(lambda v: (first.append(v.copy()), bowl(v))[1], 3, EvolutionSettings(generations=1))
    for column in first[0].T:
        assert sorted(np.floor(column * 45).astype(int)) == list(range(45))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_failed_vectors_never_win(bad: float) -> None:
    def evaluate(vectors: np.ndarray) -> np.ndarray:
        return np.where(vectors[:, 0] > 0.5, bad, bowl(vectors))

    result = evolve(evaluate, 3, EvolutionSettings(generations=20, tolerance=0.0))
    assert np.isfinite(result.cost)
    assert result.best[0] <= 0.5


def test_a_search_in_which_everything_fails_ends_and_says_infinite() -> None:
    result = evolve(lambda v: np.full(len(v), np.nan), 2, EvolutionSettings(generations=2))
    assert result.cost == np.inf
    assert result.evaluations % 45 == 0
    assert result.reason == "all 2 generations were used"


def test_convergence_is_noticed_and_named() -> None:
    flat = evolve(lambda v: 5.0 + 1e-9 * v[:, 0], 2, EvolutionSettings())
    assert flat.converged
    assert "0.001 of the best" in flat.reason
    assert len(flat.history) == 2
    narrow = evolve(
        bowl, 3, EvolutionSettings(strategy="best1bin", generations=500, tolerance=0.0, spread_tolerance=1e-4)
    )
    assert narrow.converged
    assert "narrower than 0.0001" in narrow.reason


def test_a_wrong_number_of_costs_is_refused() -> None:
    with pytest.raises(RuntimeError, match="45 vectors"):
        evolve(lambda v: np.zeros(3), 2, EvolutionSettings())


def test_polish_finds_the_least_squares_answer_of_a_linear_problem() -> None:
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(50, 3))
    target = matrix @ TRUE + 0.1 * rng.normal(size=50)
    result = polish(
        lambda v: [(matrix @ u - target) / 0.1 for u in v], np.array([0.9, 0.1, 0.9]), PolishSettings()
    )
    np.testing.assert_allclose(result.best, np.linalg.lstsq(matrix, target, rcond=None)[0], atol=1e-6)
    np.testing.assert_allclose(result.jacobian, matrix / 0.1, rtol=1e-5)
    assert result.converged


def test_jacobians_are_asked_for_in_one_batch() -> None:
    sizes = []

    def evaluate(vectors: np.ndarray) -> list[np.ndarray]:
        sizes.append(len(vectors))
        return [decay(u) - decay(TRUE) for u in vectors]

    polish(evaluate, np.array([0.6, 0.2, 0.3]), PolishSettings())
    assert set(sizes) == {1, 3, 6}  # trial steps, one-sided differences on the way, central ones at the end
    assert sizes[-2:] == [6, 6]


def test_polish_stays_within_the_bounds() -> None:
    result = polish(
        lambda v: [np.array([u[0] - 1.5, u[1] + 0.5]) for u in v], np.array([0.5, 0.5]), PolishSettings()
    )
    np.testing.assert_allclose(result.best, [1.0, 0.0], atol=1e-4)


def test_polish_survives_failing_neighbours() -> None:
    def evaluate(vectors: np.ndarray) -> list[np.ndarray | None]:
        return [None if u[0] > 0.5005 else decay(u) - decay(TRUE) for u in vectors]

    result = polish(evaluate, np.array([0.2, 0.2, 0.3]), PolishSettings())
    np.testing.assert_allclose(result.best, TRUE, atol=1e-4)


def test_polish_of_a_vector_that_fails_is_a_result() -> None:
    result = polish(lambda v: [None] * len(v), np.array([0.5]), PolishSettings())
    assert result.residual is None
    assert "could not be simulated" in result.reason


def test_robust_errors_ignore_outliers() -> None:
    measured = decay(TRUE) + 0.1 * noise(1)
    measured[::50] += 30.0
    for error, limit in (("huber", 0.05), ("absolute", 0.05)):
        result, _ = fitted(decay, measured, error=error)
        assert np.max(np.abs(result.best - TRUE)) < limit
    squared, _ = fitted(decay, measured)
    assert np.max(np.abs(squared.best - TRUE)) > 0.1


@pytest.mark.parametrize(("rho", "least"), [(0.0, 0.92), (0.9, 0.86)])
def test_intervals_cover_the_truth_under_correlated_noise(rho: float, least: float) -> None:
    hits, naive = [], []
    for seed in range(60):
        result, sure = fitted(decay, decay(TRUE) + 0.1 * noise(seed, rho))
        information = result.jacobian.T @ result.jacobian
        plain = np.sqrt(np.diag(np.linalg.inv(information)))
        hits.append(np.abs(result.best - TRUE) < 1.96 * sure.stderr)
        naive.append(np.abs(result.best - TRUE) < 1.96 * plain)
    assert np.mean(hits) > least
    if rho > 0.0:
        assert np.mean(naive) < 0.6  # the same formula without the correlation misleads


def test_noise_common_to_two_channels_is_not_counted_twice() -> None:
    def two(u: np.ndarray) -> np.ndarray:
        return np.concatenate([np.full(1000, u[0]), np.full(1000, u[0])])

    common = 0.1 * np.random.default_rng(2).normal(size=1000)
    measured = 0.5 + np.concatenate([common, common])
    groups = [[slice(0, 1000), slice(1000, 2000)]]
    _, sure = fitted(two, measured, start=(0.3,), groups=groups)
    assert sure.stderr[0] == pytest.approx(0.1 / np.sqrt(1000), rel=0.2)
    separate = [[slice(0, 1000)], [slice(1000, 2000)]]
    _, wrong = fitted(two, measured, start=(0.3,), groups=separate)
    assert wrong.stderr[0] == pytest.approx(0.1 / np.sqrt(2000), rel=0.2)


def test_the_stated_noise_does_not_matter_only_the_residual_does() -> None:
    measured = decay(TRUE) + 0.1 * noise(3)
    _, right = fitted(decay, measured, sigma=0.1)
    _, wrong = fitted(decay, measured, sigma=1.0)
    np.testing.assert_allclose(right.stderr, wrong.stderr, rtol=0.05)


def test_a_sum_of_two_parameters_is_not_two_parameters() -> None:
    def model(u: np.ndarray) -> np.ndarray:
        return (u[0] + u[1]) * np.exp(-TIME) + u[2]

    _, sure = fitted(model, model(TRUE) + 0.1 * noise(4))
    assert sure.reasons == (
        "the fitted signals determine only a combination of it with b",
        "the fitted signals determine only a combination of it with a",
        "",
    )
    assert np.isnan(sure.stderr[:2]).all()
    assert 0.0 < sure.stderr[2] < 0.01


def test_a_parameter_without_effect_is_named_and_harms_no_other() -> None:
    def model(u: np.ndarray) -> np.ndarray:
        return u[0] * np.exp(-TIME) + u[2]

    _, sure = fitted(model, model(TRUE) + 0.1 * noise(5))
    assert sure.reasons == ("", "no fitted signal responds to it", "")
    assert np.isfinite(sure.stderr[[0, 2]]).all()


def test_too_weak_an_effect_is_named() -> None:
    def model(u: np.ndarray) -> np.ndarray:
        return u[0] * np.exp(-TIME) + 1e-3 * u[1] + 0.0 * u[2]

    _, sure = fitted(model, model(TRUE) + 0.1 * noise(6))
    assert sure.reasons[1] in ("its standard error is as wide as its bounds", "it lies on its lower bound")


def test_a_bound_that_holds_is_named() -> None:
    _, sure = fitted(lambda u: u[0] * TIME, -0.1 * TIME, start=(0.3,))
    assert sure.reasons == ("it lies on its lower bound",)


def test_strongly_but_not_wholly_correlated_parameters_stay_determined() -> None:
    def model(u: np.ndarray) -> np.ndarray:
        return u[0] * np.exp(-TIME) + u[1] * np.exp(-1.1 * TIME)

    _, sure = fitted(model, model(TRUE) + 0.01 * noise(7), start=(0.4, 0.4), sigma=0.01)
    assert sure.reasons == ("", "")
    assert sure.correlation[0, 1] < -0.95


def test_long_run_covariance_of_an_autoregression() -> None:
    rho = 0.5
    total = np.mean([long_run_covariance(noise(s, rho)[:, None], 60)[0, 0] / TIME.size for s in range(30)])
    assert total == pytest.approx((1.0 + rho) / (1.0 - rho), rel=0.1)


def test_uncertain_held_values_widen_the_errors_as_simulated() -> None:
    """y = (a + h) e^-t + b with h held at a noisy guess: a inherits all of the guess's error, b none of it."""

    def model(u: np.ndarray, held: float) -> np.ndarray:
        return (u[0] + held) * np.exp(-TIME) + u[1]

    found, stated = [], []
    for seed in range(40):
        guess = 0.2 + 0.05 * np.random.default_rng(1000 + seed).normal()
        measured = model(np.array([0.4, 0.3]), 0.2) + 0.1 * noise(seed)
        result, sure = fitted(lambda u, g=guess: model(u, g), measured, start=(0.5, 0.5))
        slope = (np.exp(-TIME) / 0.1)[:, None]
        widened = with_given(sure, result.jacobian, slope, np.array([[0.05**2]]))
        found.append(result.best)
        stated.append(widened.stderr)
        assert widened.stderr[1] == pytest.approx(sure.stderr[1], rel=1e-6)
    assert np.std(found, axis=0) == pytest.approx(np.mean(stated, axis=0), rel=0.3)
    assert np.mean(stated, axis=0)[0] > 0.05


def test_the_profile_of_a_linear_model_is_its_standard_error() -> None:
    def model(u: np.ndarray) -> np.ndarray:
        return u[0] * np.exp(-TIME) + u[1] * np.exp(-0.5 * TIME)

    measured = model(np.array([0.5, 0.4])) + 0.1 * noise(8)
    result, _ = fitted(model, measured, start=(0.4, 0.4))
    plain = np.sqrt(np.diag(np.linalg.inv(result.jacobian.T @ result.jacobian)))
    found = profile(
        lambda v: [(model(u) - measured) / 0.1 for u in v],
        result.best,
        0,
        float(plain[0]),
        CHI2_95,
        PolishSettings(),
    )
    assert found.upper - result.best[0] == pytest.approx(1.96 * plain[0], rel=1e-3)
    assert result.best[0] - found.lower == pytest.approx(1.96 * plain[0], rel=1e-3)
    rise = (found.positions - result.best[0]) ** 2 / plain[0] ** 2
    np.testing.assert_allclose(found.costs - found.costs.min(), rise, rtol=1e-3, atol=1e-6)


def test_a_one_sided_profile_says_so() -> None:
    """Only u > 0.5 shows: below, the cost is flat, and the interval has no lower end."""

    def evaluate(vectors: np.ndarray) -> list[np.ndarray]:
        return [np.array([10.0 * max(u[0] - 0.5, 0.0), 1.0]) for u in vectors]

    found = profile(evaluate, np.array([0.5]), 0, 0.1, CHI2_95, PolishSettings())
    assert np.isnan(found.lower)
    assert found.upper == pytest.approx(0.5 + np.sqrt(CHI2_95) / 10.0, rel=1e-6)


def jumpy(amplitude, jumps=0.0, draw=0):
    """A model of two parameters, 3000 samples, whose solver steps otherwise for every vector; its exact Jacobian.

    ``amplitude``: of what that does to each sample, in noise; ``jumps``: share of the vectors that err by 30 in some.
    """
    t = np.linspace(0.0, 6.0, 3000)
    noise = np.random.default_rng(5).normal(0.0, 1.0, t.size)

    def model(x: np.ndarray) -> np.ndarray:
        return 20.0 * x[0] * np.sin(t) + 8.0 * np.exp(-(0.5 + x[1]) * t)

    def residual(x: np.ndarray) -> np.ndarray:
        # another draw for every vector, but the same whatever a machine's BLAS makes of its last bits
        rng = np.random.default_rng([draw, *np.round(1e9 * x).astype(np.uint64)])
        found = model(x) - model(np.array([0.4, 0.6])) - noise + amplitude * rng.normal(0.0, 1.0, t.size)
        if rng.random() < jumps:
            found[rng.integers(0, 2900) :][:60] += 30.0
        return found

    slopes = np.column_stack((20.0 * np.sin(t), -8.0 * t * np.exp(-1.1 * t)))
    return lambda vectors: [residual(x) for x in vectors], slopes


def polished_jumpy(amplitude: float, jumps: float = 0.0, draw: int = 0) -> Uncertainty:
    """What is stated of the two parameters of `jumpy`."""
    evaluate, _ = jumpy(amplitude, jumps, draw)
    found = polish(evaluate, np.array([0.41, 0.58]), PolishSettings())
    assert found.residual is not None
    assert found.jacobian is not None
    assert found.jacobian_error is not None
    groups = [[slice(0, 3000)]]
    return estimate_uncertainty(
        found.best, found.residual, found.jacobian, found.jacobian_error, groups, ["a", "b"]
    )


@pytest.mark.parametrize(("amplitude", "jumps"), [(0.0, 0.0), (0.02, 0.0), (1e-3, 0.2)])
def test_the_noise_of_a_solver_costs_no_standard_error(amplitude: float, jumps: float) -> None:
    sure = polished_jumpy(
        amplitude, jumps, draw=1
    )  # of other draws some jump where the slope is taken, and hide it
    _, slopes = jumpy(amplitude)
    assert sure.reasons == ("", "")
    exact = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    assert sure.stderr == pytest.approx(exact, rel=0.25)


def test_a_slope_that_the_noise_of_the_solver_hides_is_said_to_be_hidden() -> None:
    sure = polished_jumpy(20.0)
    assert all("solver noise" in reason for reason in sure.reasons)


def sure_of(hidden: float, overlap: float) -> Uncertainty:
    """Two slopes that ``overlap``; the error of the first is ``hidden`` times its size, of the second a thousandth."""
    rng = np.random.default_rng(3)
    plain, other, doubt = np.linalg.qr(rng.normal(size=(400, 3)))[0].T
    jacobian = 100.0 * np.column_stack((plain, overlap * plain + np.sqrt(1.0 - overlap**2) * other))
    error = 100.0 * np.column_stack((hidden * doubt, 1e-3 * doubt))
    residual = rng.normal(size=400)
    return estimate_uncertainty(
        np.array([0.4, 0.6]), residual, jacobian, error, [[slice(0, 400)]], ["a", "b"]
    )


def test_a_slope_that_is_hidden_takes_no_other_with_it() -> None:
    """As on two FMUs of Dymola: one column of nothing but jumps, and no parameter at all had a standard error."""
    sure = sure_of(hidden=1.5, overlap=0.0)
    assert sure.reasons == (SOLVER_NOISE, "")
    assert np.isnan(sure.stderr[0])
    assert sure.stderr[1] == pytest.approx(0.01, rel=0.15)


def test_noise_of_the_solver_is_no_combination_of_parameters() -> None:
    """Slopes at right angles cannot be mistaken for each other, whatever the noise does to them."""
    assert sure_of(hidden=0.4, overlap=0.0).reasons == (SOLVER_NOISE, SOLVER_NOISE)


def test_a_combination_is_no_noise_of_the_solver() -> None:
    sure = sure_of(hidden=1e-3, overlap=1.0 - 1e-8)
    assert all("determine only a combination" in reason for reason in sure.reasons)
