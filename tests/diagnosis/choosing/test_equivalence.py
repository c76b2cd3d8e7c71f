"""Principal angles and classes of candidates that recordings cannot tell apart, against geometry."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.diagnosis.choosing.equivalence import equivalence, principal_angles
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns

N = 400
BASIS = np.linalg.qr(np.random.default_rng(1).standard_normal((N, 6)))[0]


def test_angles_are_those_of_the_geometry():
    e = BASIS
    plane = np.stack([e[:, 0], e[:, 1] + 5.0 * e[:, 0]], axis=1)
    tilted = 3.0 * (np.cos(0.4) * e[:, [1]] + np.sin(0.4) * e[:, [2]])
    across = e[:, [3]]
    twice = np.repeat(across, 2, axis=1)  # spans a line only
    found = principal_angles([plane, tilted, across, twice])
    expected = np.full((4, 4), np.pi / 2)
    np.fill_diagonal(expected, 0.0)
    expected[0, 1] = expected[1, 0] = 0.4
    expected[2, 3] = expected[3, 2] = 0.0
    np.testing.assert_allclose(found, expected, atol=1e-6)


def proposal(name: str, response: np.ndarray, size: float = 1.0) -> Any:
    """A candidate with one coefficient whose ordinary size moves the residuals by ``size`` along ``response``."""
    parameter = SimpleNamespace(typical=size)
    candidate = SimpleNamespace(name=name, key=name, coefficients=(parameter,))
    left = response - BASIS[:, 0] * (BASIS[:, 0] @ response)  # the declared parameter imitates BASIS[:, 0]
    return SimpleNamespace(
        candidate=candidate, response=response[:, None], precision=np.array([[left @ left]])
    )


def attribution(*proposals: Any, threshold: float = 16.0) -> Any:
    unknowns = Unknowns((Unknown("p", "p", "1", 1.0, np.inf, 1.0, 0.0, 9.0),))
    jacobian = 1e3 * BASIS[:, [0]]
    base = Fit(unknowns, np.ones(1), np.zeros(N), jacobian, np.ones(1), 0.0, True)
    rounds = (SimpleNamespace(threshold=threshold, proposals=proposals),) if proposals else ()
    return SimpleNamespace(rounds=rounds, base=base)


def at(angle: float, size: float, declared: float = 0.0) -> np.ndarray:
    """A response at ``angle`` from BASIS[:, 1], with a part that the declared parameter imitates."""
    return size * (np.cos(angle) * BASIS[:, 1] + np.sin(angle) * BASIS[:, 2]) + declared * BASIS[:, 0]


def test_candidates_are_alike_if_chance_covers_what_tells_them_apart():
    # sin(angle) * size against sqrt(16) = 4: an effect of size 20 is told apart from 11.5 degrees on.
    near = equivalence(attribution(proposal("a", at(0.0, 20.0)), proposal("b", at(0.15, 20.0, 50.0))))
    far = equivalence(attribution(proposal("a", at(0.0, 20.0)), proposal("b", at(0.25, 20.0, 50.0))))
    assert [c.names for c in near] == [("a", "b")]
    assert near[0].angle_deg == pytest.approx(np.degrees(0.15), rel=1e-3)
    assert far == ()


def test_within_a_class_every_two_are_alike():
    chain = [proposal(n, at(k * 0.15, 20.0)) for k, n in enumerate("abcd")]
    classes = equivalence(attribution(*chain))
    assert all(len(c.names) == 2 for c in classes)


def test_what_drowns_in_chance_is_in_no_class_and_the_best_start_counts():
    weak = proposal("weak", at(0.0, 3.0))
    best, other = proposal("a", at(0.0, 20.0)), proposal("a", at(1.5, 20.0))
    second = proposal("b", at(0.05, 20.0))
    assert [c.names for c in equivalence(attribution(best, second, other, weak))] == [("a", "b")]
    assert equivalence(attribution(weak, best)) == ()
    assert equivalence(attribution()) == ()


def test_an_effect_is_as_large_as_its_ordinary_size_squared_makes_it():
    """Half a unit of a response of 10: a gain of 25, above the 16 of chance."""
    halves = [proposal(name, at(angle, 10.0), size=0.5) for name, angle in (("a", 0.0), ("b", 0.05))]
    assert [c.names for c in equivalence(attribution(*halves))] == [("a", "b")]
    assert equivalence(attribution(*halves, threshold=25.1)) == ()


def test_classes_come_closest_first_and_one_of_many_coefficients_counts_by_its_strongest():
    e = BASIS

    def tilted(angle: float, first: int, size: float) -> np.ndarray:
        return size * (np.cos(angle) * e[:, first] + np.sin(angle) * e[:, 5])

    wide = [proposal("a", tilted(0.0, 1, 20.0)), proposal("b", tilted(0.15, 1, 20.0))]
    close = [proposal("c", tilted(0.0, 2, 20.0)), proposal("d", tilted(0.05, 2, 20.0))]
    found = equivalence(attribution(*wide, *close))
    assert [c.names for c in found] == [("c", "d"), ("a", "b")]
    assert found[0].angle_deg == pytest.approx(np.degrees(0.05), rel=1e-3)
    # Four hundred times as large in its unit at a twentieth of its size is the same candidate.
    scaled = proposal("b", tilted(0.15, 1, 400.0), size=0.05)
    assert [c.names for c in equivalence(attribution(wide[0], scaled))] == [("a", "b")]


def test_what_does_nothing_is_at_a_right_angle_and_sizes_do_not_matter():
    e = BASIS
    nothing, long = np.zeros((N, 1)), np.stack([1e6 * e[:, 1], 1e-3 * e[:, 2]], axis=1)
    found = principal_angles([nothing, long, e[:, [2]]])
    assert found[0, 1] == pytest.approx(np.pi / 2)
    assert found[1, 2] == pytest.approx(0.0, abs=1e-6)
    assert found.dtype == np.float64
