"""Laws over temperature: the published ones from noisy points, selection, and bad input."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thsa_cosim.errors import InputError
from thsa_cosim.laws import (
    CANDIDATES,
    FORMS,
    Law,
    candidates_for,
    fit_law,
    largest_deviation,
    published_law,
    quantity_of,
    select_law,
)

POINTS = np.array([25.0, 0.0, -10.0, -20.0, -30.0, -40.0, -50.0, -55.0])
PUBLISHED = {
    "R_s": ("cubic", [1.2, 3e-2, 7e-5, -5e-6]),
    "psi_pm": ("quadratic", [0.1, 6e-5, -4e-6]),
    "T_fm": ("double-exponential", [1e-2, -4e-2, 3e-2, 9e-3]),
    "b_m": ("cubic", [4e-5, 2e-8, 1e-8, 1e-10]),
    "T_fg": ("quadratic", [11.0, -0.25, 2e-4]),
    "b_g": ("linear", [-6e-7, 1.8e-7]),
    "F_fn": ("cubic", [2.7e3, 37.0, -1.4, -0.07]),
    "b_n": ("quadratic", [4e4, -3e3, 230.0]),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_exact_points_give_back_the_published_coefficients(name: str) -> None:
    form, coefficients = PUBLISHED[name]
    law = fit_law(form, POINTS, published_law(form, coefficients)(POINTS))
    np.testing.assert_allclose(law.coefficients, coefficients, rtol=1e-6)


@pytest.mark.parametrize("name", PUBLISHED)
def test_noisy_points_give_the_curve_and_an_honest_error(name: str) -> None:
    form, coefficients = PUBLISHED[name]
    true = published_law(form, coefficients)
    values = true(POINTS)
    sigma = 0.01 * np.max(np.abs(values)) * np.linspace(0.5, 1.5, POINTS.size)
    where = np.linspace(-50.0, 20.0, 15)
    inside = []
    for seed in range(40):
        noisy = values + sigma * np.random.default_rng(seed).normal(size=values.shape)
        law = fit_law(form, POINTS, noisy, sigma)
        assert largest_deviation(law, true, POINTS) < 0.06
        inside.append(np.abs(law(where) - true(where)) < 1.96 * law.stderr(where))
    assert np.mean(inside) > 0.85


@pytest.mark.parametrize("name", ["R_s", "psi_pm", "T_fm", "F_fn", "b_n"])
def test_selection_finds_the_published_form(name: str) -> None:
    form, coefficients = PUBLISHED[name]
    values = published_law(form, coefficients)(POINTS)
    sigma = np.full(POINTS.shape, 0.002 * np.max(np.abs(values)))
    found = []
    for seed in range(10):
        noisy = values + sigma * np.random.default_rng(seed).normal(size=values.shape)
        best, ranked = select_law(POINTS, noisy, sigma)
        found.append(best.form)
        assert ranked[0] is best
        assert [law.aicc for law in ranked] == sorted(law.aicc for law in ranked)
    assert found.count(form) >= 8


def test_selection_prefers_the_simpler_form_when_the_points_are_all_noise() -> None:
    sigma = np.full(POINTS.shape, 0.1)
    forms = [
        select_law(POINTS, 1.0 + sigma * np.random.default_rng(s).normal(size=8), sigma)[0].form
        for s in range(20)
    ]
    assert forms.count("constant") >= 12


def test_selection_works_with_two_points() -> None:
    best, ranked = select_law(np.array([0.0, 10.0]), np.array([1.0, 2.0]))
    assert {law.form for law in ranked} == {"constant", "linear", "exponential"}
    assert best.form == "constant"


@settings(max_examples=40, deadline=None)
@given(st.floats(-0.08, 0.06), st.floats(0.02, 0.1), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_double_exponentials_are_found_from_any_start(
    beta: float, distance: float, alpha_1: float, alpha_2: float
) -> None:
    true = Law("double-exponential", (alpha_1, beta, alpha_2, beta + distance))
    values = true(POINTS)
    if np.max(np.abs(values)) < 1e-3:
        return
    law = fit_law("double-exponential", POINTS, values)
    assert largest_deviation(law, true, np.linspace(-55.0, 25.0, 30)) < 1e-4


def test_the_exponential_alone() -> None:
    law = fit_law("exponential", POINTS, 2.0 * np.exp(-0.03 * POINTS))
    np.testing.assert_allclose(law.coefficients, [2.0, -0.03], rtol=1e-8)


@pytest.mark.parametrize("coefficients", [(1e-5, 800.0, -150.0), (1e-3, 300.0, -90.0), (2.0, 1500.0, -250.0)])
def test_vogel_laws_are_found_and_chosen(coefficients: tuple[float, float, float]) -> None:
    true = published_law("vogel", coefficients)
    values = true(POINTS)
    law = fit_law("vogel", POINTS, values)
    np.testing.assert_allclose(
        law(np.linspace(-55.0, 25.0, 30)), true(np.linspace(-55.0, 25.0, 30)), rtol=1e-5
    )
    sigma = 0.01 * values
    forms = candidates_for(quantity_of("N/(m/s)"))
    found = []
    for seed in range(10):
        noisy = values + sigma * np.random.default_rng(seed).normal(size=values.shape)
        found.append(select_law(POINTS, noisy, sigma, forms)[0].form)
    assert found.count("vogel") >= 8


def test_a_vogel_law_never_thins_in_the_cold() -> None:
    law = fit_law("vogel", POINTS, 1.0 + 0.01 * POINTS)
    assert np.ptp(law(POINTS)) == pytest.approx(0.0, abs=1e-6)


def test_copper_is_one_number_and_beats_the_line() -> None:
    """Also as start values of a block, where it is a straight line."""
    true = published_law("copper", [1.9])
    assert float(true(20.0)) == pytest.approx(1.9)
    assert float(true(-30.0)) == pytest.approx(1.9 * (1.0 - 50.0 * 3.93e-3))
    values, sigma = true(POINTS), np.full(POINTS.shape, 0.01)
    forms = candidates_for(quantity_of("Ohm"))
    found = []
    for seed in range(10):
        noisy = values + sigma * np.random.default_rng(seed).normal(size=values.shape)
        found.append(select_law(POINTS, noisy, sigma, forms)[0].form)
    assert found.count("copper") >= 8
    block = true.block_values("motor.R_s")
    line = published_law("linear", [block["motor.R_s.a0"], block["motor.R_s.a1"]])
    np.testing.assert_allclose(line(POINTS), values, rtol=1e-12)


def test_a_spline_passes_through_its_points_in_any_order() -> None:
    order = np.random.default_rng(3).permutation(POINTS.size)
    values = np.sin(POINTS / 20.0)
    law = fit_law("spline", POINTS[order], values[order])
    np.testing.assert_allclose(law(POINTS), values, atol=1e-12)
    assert list(law.knots) == sorted(law.knots)
    assert np.isnan(law.stderr(POINTS)).all()


def test_an_unsure_point_pulls_less() -> None:
    values = np.full(POINTS.shape, 3.0)
    values[0] = 4.0
    sigma = np.full(POINTS.shape, 0.01)
    sigma[0] = 10.0
    assert fit_law("constant", POINTS, values, sigma).coefficients[0] == pytest.approx(3.0, abs=1e-5)
    sigma[0] = np.nan  # not determined: as unsure as the least sure of the others, never surer
    assert fit_law("constant", POINTS, values, sigma).coefficients[0] == pytest.approx(3.125)


def test_unknown_errors_are_estimated_from_the_scatter() -> None:
    rng = np.random.default_rng(5)
    t = np.linspace(-55.0, 25.0, 200)
    law = fit_law("linear", t, 1.0 + 0.1 * t + 0.5 * rng.normal(size=t.shape))
    assert float(law.stderr(-15.0)) == pytest.approx(0.5 / np.sqrt(200), rel=0.15)


@pytest.mark.parametrize("form", [form for form in FORMS if form != "spline"])
def test_the_covariance_uses_the_true_derivative(form: str) -> None:
    values = published_law("double-exponential", [1e-2, -4e-2, 3e-2, 9e-3])(POINTS)
    law = fit_law(form, POINTS, values, np.full(POINTS.shape, 0.01))
    assert law.covariance is not None
    step = np.array([1e-6 * max(abs(c), 1e-3) for c in law.coefficients])
    at = np.array([-33.0])
    gradient = []
    for k in range(len(step)):
        shifted = np.array(law.coefficients)
        shifted[k] += step[k]
        gradient.append((Law(form, tuple(shifted))(at)[0] - law(at)[0]) / step[k])
    expected = np.sqrt(np.array(gradient) @ law.covariance @ np.array(gradient))
    assert float(law.stderr(-33.0)) == pytest.approx(expected, rel=1e-3)


def test_block_values_are_the_eight_coefficients_of_the_model() -> None:
    cubic = published_law("cubic", [1.2, 3e-2, 7e-5, -5e-6]).block_values("motor.R_s")
    assert cubic["motor.R_s.a3"] == -5e-6
    assert cubic["motor.R_s.alpha1"] == 0.0
    assert len(cubic) == 8
    double = published_law("double-exponential", [1e-2, -4e-2, 3e-2, 9e-3]).block_values("motor.T_fm")
    assert (double["motor.T_fm.alpha2"], double["motor.T_fm.beta2"], double["motor.T_fm.a0"]) == (
        3e-2,
        9e-3,
        0.0,
    )
    for form in ("spline", "vogel"):
        with pytest.raises(InputError, match=form):
            fit_law(form, POINTS, POINTS).block_values("motor.R_s")


def test_bad_input_is_one_sentence() -> None:
    with pytest.raises(InputError, match=r"'cubik'\. Did you mean 'cubic'"):
        fit_law("cubik", POINTS, POINTS)
    with pytest.raises(InputError, match="needs 4 temperatures, but there are 3"):
        fit_law("cubic", POINTS[:3], POINTS[:3])
    with pytest.raises(InputError, match="takes 2 coefficients, not 3"):
        published_law("linear", [1.0, 2.0, 3.0])
    assert set(CANDIDATES) < set(FORMS)
