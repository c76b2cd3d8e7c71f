"""How far several starts end apart, and how far a fit still is from its optimum: closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.identified import between_starts
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns

JACOBIAN = np.random.default_rng(5).standard_normal((400, 2))


def fit(vector: np.ndarray, spread: float = np.inf, upper: float = 9.0) -> Fit:
    """A linear model whose data are 1 and -2, at ``vector``; unknowns in halves."""
    members = tuple(Unknown(n, n, "1", 0.0, spread, 0.5, -9.0, upper) for n in "ab")
    residual = JACOBIAN @ (vector - np.array([1.0, -2.0]))
    return Fit(Unknowns(members), vector, residual, 0.5 * JACOBIAN, np.ones(2), 10.0, True)


def test_starts_that_end_in_one_place_add_nothing_and_ends_as_likely_add_their_distance():
    best = fit(np.array([1.0, -2.0]))
    assert not between_starts(best, []).any()
    assert not between_starts(best, [(best.vector, 10.0)]).any()
    apart = between_starts(best, [(best.vector + np.array([0.3, 0.0]), 10.0)])
    np.testing.assert_allclose(apart, [0.3 / 2**0.5, 0.0])
    both = between_starts(
        best, [(best.vector + np.array([0.3, 0.0]), 10.0), (best.vector - np.array([0.3, 0.6]), 10.0)]
    )
    np.testing.assert_allclose(both, [0.3 * (2 / 3) ** 0.5, 0.6 / 3**0.5])


def test_an_end_that_costs_more_is_less_likely_by_what_the_recordings_leave():
    best = fit(np.array([1.0, -2.0]))
    weight = np.exp(-2.0)
    far = [(best.vector + 1.0, 14.0)]
    np.testing.assert_allclose(between_starts(best, far), np.sqrt(weight / (1.0 + weight)))
    loud = replace(best, residual=np.full(400, 2.0))
    weight = np.exp(-0.5)
    np.testing.assert_allclose(between_starts(loud, far), np.sqrt(weight / (1.0 + weight)))
    assert between_starts(best, [(best.vector + 1.0, 500.0)]).max() < 1e-9


def test_the_remaining_step_ends_in_the_optimum_of_data_and_drawing():
    np.testing.assert_allclose(fit(np.array([0.9, -1.0])).remaining_step, [0.1, -1.0], atol=1e-12)
    tight = fit(np.zeros(2), spread=0.2)
    information = JACOBIAN.T @ JACOBIAN
    expected = np.linalg.solve(information + np.eye(2) / 0.04, information @ [1.0, -2.0])
    np.testing.assert_allclose(tight.remaining_step, expected, rtol=1e-9)


def test_a_bound_holds_the_remaining_step():
    np.testing.assert_allclose(fit(np.array([0.5, -2.0]), upper=0.5).remaining_step, [0.0, 0.0], atol=1e-12)
    assert fit(np.array([0.5, -2.5]), upper=0.5).remaining_step[1] == pytest.approx(0.5)
