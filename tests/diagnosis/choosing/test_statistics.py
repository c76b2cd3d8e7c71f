"""What chance does, what is structure, and what repeats over position: against known distributions."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from thsa_cosim.diagnosis.choosing.chance import largest_gains, probability, threshold
from thsa_cosim.diagnosis.choosing.wave_numbers import wave_numbers
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.structure import (
    FEWEST,
    block_gains,
    block_squares,
    consistency,
    errors,
    errors_by_recording,
    relative_consistency,
    structure,
    worst_share,
)
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns

N = 3000
SEED = 2
RNG = np.random.default_rng(SEED)


@pytest.fixture(autouse=True)
def own_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test draws the same numbers whatever runs before it."""
    monkeypatch.setitem(globals(), "RNG", np.random.default_rng(SEED))


def base() -> Fit:
    unknowns = Unknowns((Unknown("p", "p", "1", 1.0, np.inf, 1.0, 0.0, 9.0),))
    return Fit(unknowns, np.ones(1), np.zeros(N), RNG.standard_normal((N, 1)), np.ones(1), 0.0, True)


def proposal(fit: Fit, count: int) -> Any:
    """A candidate with ``count`` coefficients whose responses are random."""
    response = RNG.standard_normal((N, count))
    left = response - fit.jacobian @ np.linalg.lstsq(fit.jacobian, response, rcond=None)[0]
    return SimpleNamespace(response=response, precision=left.T @ left, is_testable=True)


@pytest.mark.parametrize("coefficients", [1, 2])
def test_one_candidate_gains_chi_square_by_chance(coefficients: int):
    fit = base()
    gains = largest_gains(fit, [proposal(fit, coefficients)], seed=4, draws=2000)
    assert stats.kstest(gains, stats.chi2(coefficients).cdf).pvalue > 1e-3


def test_two_coefficients_that_do_the_same_gain_as_one_does():
    fit = base()
    one, other = proposal(fit, 1).response, proposal(fit, 1).response
    response = np.concatenate([one, one + 3e-4 * other], axis=1)
    alike = SimpleNamespace(response=response, is_testable=True)
    gains = largest_gains(fit, [alike], seed=4, draws=2000)  # type: ignore[list-item]
    assert stats.kstest(gains, stats.chi2(1).cdf).pvalue > 1e-3


def test_the_best_of_many_candidates_gains_more_and_the_threshold_covers_it():
    fit = base()
    many = [proposal(fit, 1) for _ in range(30)]
    gains = largest_gains(fit, many, seed=4, draws=2000)
    best = stats.chi2(1).ppf(np.array([0.1, 0.5, 0.9]) ** (1.0 / 30.0))
    np.testing.assert_allclose(np.quantile(gains, [0.1, 0.5, 0.9]), best, rtol=0.1)
    limit = threshold(gains, 1e-3)
    exact = stats.chi2(1).ppf((1.0 - 1e-3) ** (1.0 / 30.0))
    assert limit == pytest.approx(exact, rel=0.15)
    assert probability(limit, gains) == pytest.approx(1e-3, rel=1e-6)
    assert probability(0.0, gains) > 0.99
    assert (probability(-1e9, gains), probability(1e9, gains)) == (1.0, pytest.approx(0.0, abs=1e-300))
    assert probability(0.01 * limit, 0.01 * gains) == pytest.approx(1e-3, rel=1e-6), "in whatever unit"
    assert largest_gains(fit, [], seed=4).max() == 0.0


def trials(*lengths: int, noise: float = 0.5) -> list[Any]:
    """Recordings with two channels whose sensors have ``noise``."""
    made = []
    for length in lengths:
        channels = [
            SimpleNamespace(
                name=name, measured=np.zeros(length), time=np.arange(length) * 1e-3, noise=noise, weight=1.0
            )
            for name in ("v", "i")
        ]
        made.append(
            SimpleNamespace(
                case=SimpleNamespace(
                    channels=channels, measured=SimpleNamespace(units={"v": "m/s", "i": "A"})
                )
            )
        )
    return made


def test_white_noise_has_no_structure_whatever_its_size():
    own = trials(8000, 4000)
    for size in (0.5, 1.0, 2.0):
        residual = size * RNG.standard_normal(24000)
        assert abs(structure(own, residual)) < 5.0 * size**2 * np.sqrt(24000)
        found = errors(own, residual)
        assert all(abs(e.significance) < 4.5 * max(1.0, size) for e in found.values())
        assert found["v"].rmse == pytest.approx(0.5 * size, rel=0.03)


def test_a_smooth_residual_is_found_at_its_size_beneath_the_noise():
    own = trials(20000)
    smooth = np.sin(2 * np.pi * 1.5 * np.arange(20000) * 1e-3)
    residual = np.concatenate([RNG.standard_normal(20000) + 0.6 * smooth, RNG.standard_normal(20000)])
    found = errors(own, residual)
    assert found["v"].structure == pytest.approx(0.5 * 0.6 / np.sqrt(2.0), rel=0.05)
    assert found["v"].significance > 20.0
    assert found["i"].structure < 0.1 * found["v"].structure + 0.05
    assert found["i"].samples == 20000


def test_gains_by_blocks_of_time_say_how_sure_a_gain_is():
    own = trials(8000)
    worse = RNG.standard_normal(16000)
    assert block_gains(own, worse, 0.5 * worse).sum() == pytest.approx(0.75 * np.sum(worse**2))
    assert block_gains(own, worse, worse).size == 16  # of half a second each
    assert consistency(block_gains(own, worse, 0.5 * worse)) > 10.0
    other = RNG.standard_normal(16000)
    assert abs(consistency(block_gains(own, worse, other))) < 4.0
    assert consistency(np.array([3.0])) == 0.0


def test_mean_sees_an_effect_in_few_blocks_and_ranks_one_that_few_blocks_outweigh():
    noise = RNG.standard_normal(60)
    seldom = np.where(np.arange(60) < 14, 100.0, noise)
    assert consistency(seldom) > 3.0
    outweighed = np.where(np.arange(60) < 6, -9.0, 1.0 + 0.1 * noise)
    assert outweighed.mean() < 0.1
    assert consistency(outweighed) > 3.0
    assert max(consistency(RNG.standard_normal(60)) for _ in range(20)) < 4.0
    assert consistency(-outweighed) < 3.0


def test_share_that_is_left_is_that_of_the_worst_channel():
    own = trials(20000)
    smooth = np.sin(2 * np.pi * 1.5 * np.arange(20000) * 1e-3) * np.sqrt(2.0)

    def residual(v: float, i: float) -> np.ndarray:
        return np.concatenate([v * smooth, i * smooth]) + RNG.standard_normal(40000)

    before = residual(10.0, 2.0)

    def left(after: np.ndarray, *names: str) -> float:
        return worst_share(own, before, after, names or ("v", "i"))

    assert left(residual(0.0, 1.0)) == pytest.approx(0.25, rel=0.1)
    assert left(residual(5.0, 0.0)) == pytest.approx(0.25, rel=0.1)
    assert left(residual(0.0, 1.0), "v") < 0.02
    assert left(residual(0.0, 0.0)) < 0.02
    assert left(residual(20.0, 0.0)) == 1.0
    assert worst_share(own, before, before, ()) == 0.0


def test_short_recordings_are_cut_into_blocks_enough():
    own = trials(1000, 2000)
    squares = block_squares(own, np.ones(6000))
    assert squares.size == FEWEST
    np.testing.assert_allclose(squares, 500.0, rtol=0.01)


def test_where_errors_add_up_the_fall_of_every_block_counts_and_not_the_scatter_of_the_gains():
    """A position runs away: the last block outweighs all others; the better model stays at the noise."""
    own = trials(3000)
    drift = 1e3 * (np.arange(3000) * 1e-3 / 3.0) ** 4
    worse = np.concatenate([drift, drift]) + RNG.standard_normal(6000)
    better = RNG.standard_normal(6000)
    before, after = block_squares(own, worse), block_squares(own, better)
    assert (before - after).sum() > 1e5
    assert consistency(before - after) < 3.0, "what used to be said of it"
    assert relative_consistency(before, after) > 3.0
    assert relative_consistency(after, before) < -3.0
    chance = [
        relative_consistency(block_squares(own, RNG.standard_normal(6000)), block_squares(own, better))
        for _ in range(30)
    ]
    assert max(chance) < 4.0
    assert relative_consistency(before[:2], after[:2]) == 0.0
    assert relative_consistency(before[:3], np.zeros(3)) == 0.0


def test_every_sample_counts_the_same_in_a_pooled_error():
    own = [*trials(100, noise=0.1), *trials(300, noise=0.2)]
    residual = np.concatenate([np.full(200, 2.0), np.full(600, -3.0)])
    found = errors(own, residual)["v"]
    assert found.rmse == pytest.approx(np.sqrt((100 * 0.2**2 + 300 * 0.6**2) / 400))
    assert found.noise == pytest.approx(np.sqrt((100 * 0.1**2 + 300 * 0.2**2) / 400))
    assert (found.unit, found.samples) == ("m/s", 400)
    assert np.isnan(found.nrmse), "what stands still has no range"
    own[0].case.channels[0].measured = np.linspace(-1.0, 3.0, 100)
    assert errors(own, residual)["v"].nrmse == pytest.approx(found.rmse / 4.0)
    for trial, name in zip(own, "ab", strict=True):
        trial.case.name = name
    each = errors_by_recording(own, residual)
    assert each["a"]["i"].rmse == pytest.approx(0.2)
    assert each["b"]["v"].rmse == pytest.approx(0.6)
    pooled = np.sqrt((100 * each["a"]["v"].rmse ** 2 + 300 * each["b"]["v"].rmse ** 2) / 400)
    assert found.rmse == pytest.approx(pooled)


def test_a_ripple_over_position_is_found_by_its_wave_number():
    time = np.arange(12000) * 1e-3
    position = 8.0 * np.sin(2 * np.pi * 0.25 * time) + 1.3 * np.sin(2 * np.pi * 0.11 * time)
    residual = 0.7 * np.sin(24.0 * position + 0.4) + RNG.standard_normal(time.size)
    grid = np.arange(1.0, 61.0)
    assert wave_numbers([position], [[residual]], grid)[0] == 24.0
    assert wave_numbers([np.zeros(12000)], [[residual]], grid) == ()


def test_candidates_that_do_the_same_gain_by_chance_what_one_does_whatever_their_units():
    fit = base()
    one = proposal(fit, 1)
    twin = SimpleNamespace(response=one.response * 1e-4, is_testable=True)
    double = SimpleNamespace(
        response=np.concatenate([one.response, -3.0 * one.response], axis=1), is_testable=True
    )
    for offered in ([one, twin], [twin], [double], [double, twin]):
        gains = largest_gains(fit, offered, seed=4, draws=2000)
        assert stats.kstest(gains, stats.chi2(1).cdf).pvalue > 1e-3
