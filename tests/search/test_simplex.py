"""The simplex after a global search: edges that requirements make, bounds, failures, and the count of evaluations."""

import numpy as np
import pytest

from thsa_cosim.search import SimplexSettings, descend
from thsa_cosim.signals import FloatArray


def edged(vectors: FloatArray) -> FloatArray:
    """Falls along x + y up to the edge x² + y² = 0.5, where a requirement ends: minimum -1 at (0.5, 0.5)."""
    x, y = vectors[:, 0], vectors[:, 1]
    beyond = x**2 + y**2 - 0.5
    return np.where(beyond > 0.0, 1e9 * (1.0 + beyond), -(x + y))


def test_the_simplex_slides_along_an_edge() -> None:
    start = np.array([0.3, 0.635])
    found = descend(edged, start, float(edged(start[None, :])[0]), SimplexSettings())
    assert found.cost == pytest.approx(-1.0, abs=2e-3)


def test_a_minimum_on_the_bounds_is_reached_from_inside_and_from_the_corner() -> None:
    def slope(vectors: FloatArray) -> FloatArray:
        return 1.0 + vectors[:, 0] - vectors[:, 1]

    for start in (np.array([0.01, 0.98]), np.array([0.0, 1.0])):
        found = descend(slope, start, float(slope(start[None, :])[0]), SimplexSettings())
        assert found.best == pytest.approx([0.0, 1.0], abs=1e-3)


def test_the_start_is_kept_where_everything_else_fails() -> None:
    asked: list[FloatArray] = []

    def fails(vectors: FloatArray) -> FloatArray:
        asked.append(vectors)
        return np.full(len(vectors), np.nan)

    start = np.array([0.4, 0.6])
    found = descend(fails, start, 2.0, SimplexSettings(evaluations=20))
    assert found.cost == 2.0
    assert np.array_equal(found.best, start)
    assert found.evaluations == sum(len(v) for v in asked) <= 20


def test_a_curved_valley_of_three_directions() -> None:
    def valley(vectors: FloatArray) -> FloatArray:
        x, y, z = vectors.T
        return 1.0 + 50.0 * (y - x**2) ** 2 + (x - 0.7) ** 2 + 10.0 * (z - x * y) ** 2

    start = np.array([0.6, 0.4, 0.2])
    found = descend(valley, start, float(valley(start[None, :])[0]), SimplexSettings())
    assert found.cost == pytest.approx(1.0, abs=1e-3)
