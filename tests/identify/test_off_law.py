"""Labels of temperatures: exchanged or wrong ones are named by the laws through all points, clean ones are not."""

from dataclasses import replace

import numpy as np
import pytest

from identify.points import point_of
from thsa_cosim.identify.off_law import off_law
from thsa_cosim.identify.over_temperature import fit_laws
from thsa_cosim.identify.results import Estimate, PointResult
from thsa_cosim.scenario import LawTable

LABELS = (-55.0, -40.0, -30.0, -20.0, -10.0, 0.0, 25.0)
SPECS = {
    "R": LawTable(form="cubic"),
    "psi": LawTable(form="quadratic"),
    "T": LawTable(form="double-exponential"),
}


def points(actual: tuple[float, ...], labels: tuple[float, ...] = LABELS, seed: int = 1) -> list[PointResult]:
    """Points made at the temperatures ``actual``, labelled with ``labels``."""
    rng, found = np.random.default_rng(seed), []
    for t, label in zip(actual, labels, strict=True):
        true = {
            "R": (1.2 + 0.03 * t + 7e-5 * t**2 - 5e-6 * t**3, 0.004),
            "psi": (0.1 + 6e-5 * t - 4e-6 * t**2, 7e-6),
            "T": (1e-2 * np.exp(-0.04 * t) + 3e-2 * np.exp(9e-3 * t), 2.5e-4),
        }
        parameters = {
            name: Estimate(
                value=float(value + rng.normal(0.0, error)),
                unit="ohm" if name == "R" else "1",
                stderr=error,
                identifiable=True,
                reason="",
                lower=-9.0,
                upper=9.0,
            )
            for name, (value, error) in true.items()
        }
        found.append(point_of(label, parameters))
    return found


def said(made: list[PointResult]) -> tuple[float, ...]:
    found = off_law(made, fit_laws(made, SPECS)[0])
    return () if found is None else found[1]


@pytest.mark.parametrize("seed", range(5))
def test_points_on_their_laws_have_no_doubt(seed: int) -> None:
    assert said(points(LABELS, seed=seed)) == ()


@pytest.mark.parametrize(("a", "b"), [(2, 5), (1, 4), (0, 6)])
def test_two_labels_that_were_exchanged_are_named(a: int, b: int) -> None:
    actual = list(LABELS)
    actual[a], actual[b] = actual[b], actual[a]
    assert said(points(tuple(actual))) == (LABELS[a], LABELS[b])


def test_a_single_wrong_label_is_named() -> None:
    actual = tuple(t + 25.0 if t == -30.0 else t for t in LABELS)
    assert said(points(actual)) == (-30.0,)


def test_one_parameter_alone_may_have_another_law() -> None:
    made = points(LABELS)
    kink = made[3].parameters["R"]
    bent = {**made[3].parameters, "R": replace(kink, value=2.0 * kink.value)}
    made[3] = replace(made[3], parameters=bent)
    assert said(made) == ()


def test_too_few_points_say_nothing() -> None:
    swapped = (-30.0, -55.0, 0.0, 25.0)
    assert said(points(swapped, (-55.0, -30.0, 0.0, 25.0))) == ()
