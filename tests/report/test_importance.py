"""Importances of parameters from evaluated vectors, against a cost whose shares are known."""

import numpy as np

from thsa_cosim.report.parts.importance import importances

RNG = np.random.default_rng(3)


def test_shares_of_a_quadratic_cost() -> None:
    """Uniform x: x0² shuffled loses 16 times what x1² does; x2 does nothing; costs over decades change nothing."""
    x = RNG.uniform(-1.0, 1.0, (400, 3))
    found = importances(x, np.exp(4.0 * x[:, 0] ** 2 + x[:, 1] ** 2))
    assert found is not None
    np.testing.assert_allclose(found.shares, [16 / 17, 1 / 17, 0.0], atol=0.02)
    assert found.explained > 0.999


def test_a_parameter_over_decades_counts_by_its_logarithm() -> None:
    x = np.column_stack([np.exp(RNG.uniform(-5.0, 5.0, 300)), RNG.uniform(1.0, 2.0, 300)])
    found = importances(x, np.exp(np.log(x[:, 0]) ** 2))
    assert found is not None
    assert found.shares[0] > 0.999


def test_nothing_is_said_of_noise_few_vectors_or_a_jagged_cost() -> None:
    x = RNG.uniform(-1.0, 1.0, (200, 2))
    assert importances(x, RNG.uniform(1.0, 9.0, 200)) is None
    assert importances(x, np.exp(np.sin(40.0 * x[:, 0]))) is None
    assert importances(x[:10], np.ones(10)) is None
    assert importances(np.empty((0,)), np.empty(0)) is None
