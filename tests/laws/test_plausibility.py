"""Laws against their materials: the article's own, materials as they are, and doubts within the error."""

import numpy as np
import pytest

from laws.test_fit import POINTS, PUBLISHED
from thsa_cosim.laws import Doubt, Law, doubts_about, fit_law, published_law, quantity_of

UNITS = {
    "R_s": "ohm",
    "psi_pm": "Wb",
    "T_fm": "N.m",
    "b_m": "N.m/(rad/s)",
    "T_fg": "N.m",
    "b_g": "N.m.s/rad",
    "F_fn": "N",
    "b_n": "N/(m/s)",
}


def about(law: Law, name: str, unit: str) -> dict[str, Doubt]:
    found = doubts_about(law, quantity_of(unit), name, unit, -55.0, 25.0)
    return {doubt.kind: doubt for doubt in found}


@pytest.mark.parametrize(
    ("name", "kinds"),
    [
        ("R_s", {"direction", "rate"}),
        ("psi_pm", {"direction"}),
        ("T_fm", set()),
        ("b_m", {"direction"}),
        ("T_fg", set()),
        ("b_g", {"sign", "direction"}),
        ("F_fn", {"direction"}),
        ("b_n", {"direction"}),
    ],
)
def test_where_the_articles_laws_break_their_materials(name: str, kinds: set[str]) -> None:
    found = about(published_law(*PUBLISHED[name]), name, UNITS[name])
    assert set(found) == kinds
    assert all(doubt.severity == ("note" if name == "F_fn" else "warning") for doubt in found.values())


def test_the_sentences_have_value_temperature_and_source() -> None:
    rate = about(published_law(*PUBLISHED["R_s"]), "R_s", "ohm")["rate"]
    assert "copper that has 1.92 ohm at 25 °C" in rate.text
    assert "IEC 60028" in rate.text
    assert rate.where == (-55.0, 15.0)
    direction = about(published_law(*PUBLISHED["R_s"]), "R_s", "ohm")["direction"]
    assert direction.where == pytest.approx((-55.0, -40.5))
    sign = about(published_law(*PUBLISHED["b_g"]), "b_g", "N.m.s/rad")["sign"]
    assert sign.where[1] == pytest.approx(3.3, abs=0.6)


@pytest.mark.parametrize(
    ("unit", "law"),
    [
        ("ohm", published_law("copper", [1.9])),
        ("Wb", published_law("linear", [0.1, -1.1e-4])),
        ("V.s/rad", published_law("linear", [0.1, -1.1e-4])),
        ("N/(m/s)", published_law("vogel", [20.0, 900.0, -160.0])),
        ("N.m/(rad/s)", published_law("exponential", [1e-4, -0.05])),
        ("N", published_law("vogel", [200.0, 300.0, -140.0])),
        ("m", published_law("linear", [0.0, -1.0])),
    ],
)
def test_materials_as_they_are_raise_no_doubt(unit: str, law: Law) -> None:
    assert not about(law, "p", unit)


@pytest.mark.parametrize(
    ("unit", "law", "kind"),
    [
        ("ohm", published_law("linear", [1.0, 0.01]), "rate"),
        ("ohm", published_law("constant", [1.0]), "rate"),
        ("Wb", published_law("linear", [0.1, -4e-4]), "rate"),
        ("N/(m/s)", published_law("exponential", [1.0, -0.4]), "rate"),
        ("N/(m/s)", published_law("constant", [-1.0]), "sign"),
        ("N.m", published_law("linear", [-1.0, -0.01]), "sign"),
        ("Wb", published_law("constant", [-0.1]), "sign"),
    ],
)
def test_each_kind_of_doubt(unit: str, law: Law, kind: str) -> None:
    assert kind in about(law, "p", unit)


def test_a_steep_law_that_flattens_in_the_cold_is_no_vogel_law() -> None:
    """Falling all the way, but as a lubricant does not: flat below, steep above."""
    law = published_law("quadratic", [5.746, -0.1547, -1.40625e-3])
    assert set(about(law, "b", "N/(m/s)")) == {"rate"}
    assert "Vogel law" in about(law, "b", "N/(m/s)")["rate"].text


def test_noise_raises_no_doubt() -> None:
    """A rise within three standard errors of the law is none; the same rise without errors is one."""
    true = published_law("linear", [1.0, -2e-3])(POINTS)
    sigma = np.full(POINTS.shape, 0.2)
    for seed in range(10):
        noisy = true + sigma * np.random.default_rng(seed).normal(size=8)
        assert "direction" not in about(fit_law("quadratic", POINTS, noisy, sigma), "p", "N/(m/s)")
    rising = fit_law("linear", POINTS, 1.0 + 2e-3 * POINTS, np.full(POINTS.shape, 0.001))
    assert "direction" in about(rising, "p", "N/(m/s)")


def test_the_scenario_names_the_material_or_none() -> None:
    assert quantity_of("N", "none") is None
    found = quantity_of("ohm", "magnet-flux")
    assert found is not None
    assert found.name == "magnet-flux"
    assert quantity_of("furlong per fortnight!") is None
