"""Metrics and costs against closed forms, invariances and the figures of the rig's description."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from thsa_cosim.costs import (
    ERRORS,
    control_cost,
    error_terms,
    first_reach,
    influence,
    nrmse,
    overshoot,
    rise_time,
    rmse,
    settling_time,
    steady_state_error,
    window_mask,
)

TABLE4 = Path(__file__).parents[3] / "shared" / "recordings" / "table4"

signals = arrays(np.float64, st.integers(2, 40), elements=st.floats(-1e3, 1e3, width=32))


def second_order(time: np.ndarray, damping: float, frequency: float) -> np.ndarray:
    root = np.sqrt(1.0 - damping**2)
    phase = np.arccos(damping)
    wave = np.sin(frequency * root * time + phase) / root
    return 1.0 - np.exp(-damping * frequency * time) * wave


@given(signals, st.floats(-1e3, 1e3))
def test_rmse_of_a_constant_offset_is_its_size(measured: np.ndarray, offset: float) -> None:
    assert rmse(measured, measured + offset) == pytest.approx(abs(offset), rel=1e-9, abs=1e-9)


@given(signals, st.floats(0.01, 100.0), st.integers(0, 1000))
def test_nrmse_does_not_depend_on_the_unit(measured: np.ndarray, factor: float, seed: int) -> None:
    simulated = measured + np.random.default_rng(seed).normal(size=measured.shape)
    if np.ptp(measured) < 1e-3:
        return
    assert nrmse(factor * measured, factor * simulated) == pytest.approx(nrmse(measured, simulated), rel=1e-6)


def test_nrmse_of_a_constant_signal_is_not_a_number() -> None:
    assert np.isnan(nrmse(np.ones(5), np.zeros(5)))
    assert np.isnan(rmse(np.array([]), np.array([])))


@given(st.floats(0.05, 2.0), st.floats(0.1, 0.99), st.floats(-5.0, 5.0).filter(lambda x: abs(x) > 0.01))
def test_first_reach_of_a_ramp_is_exact(duration: float, fraction: float, final: float) -> None:
    time = np.linspace(0.0, 3.0, 301)
    ramp = final * np.clip(time / duration, 0.0, 1.0)
    # A ramp's corner is cut between samples, by at most one of them.
    assert first_reach(time, ramp, final, fraction) == pytest.approx(fraction * duration, abs=0.01)
    assert first_reach(time + 7.0, ramp, final, fraction, start=6.5) == pytest.approx(
        fraction * duration + 0.5, abs=0.01
    )


def test_first_order_step_response() -> None:
    time = np.linspace(0.0, 10.0, 100001)
    response = 1.0 - np.exp(-time)
    assert first_reach(time, response, 1.0, 0.95) == pytest.approx(-np.log(0.05), abs=1e-6)
    assert rise_time(time, response, 1.0) == pytest.approx(np.log(9.0), abs=1e-6)
    assert settling_time(time, response, 1.0, 0.02) == pytest.approx(-np.log(0.02), abs=2e-4)
    assert overshoot(response, 1.0) == 0.0
    assert np.isnan(first_reach(time, response, 2.0))
    assert np.isnan(settling_time(time[:100], response[:100], 1.0))


@given(st.floats(0.05, 0.9), st.sampled_from([-2.0, 0.5, 9e-3]))
def test_second_order_overshoot(damping: float, final: float) -> None:
    time = np.linspace(0.0, 60.0, 60001)
    response = final * second_order(time, damping, 2.0)
    expected = np.exp(-np.pi * damping / np.sqrt(1.0 - damping**2))
    assert overshoot(response, final) == pytest.approx(expected, rel=1e-3, abs=1e-5)


def test_steady_state_error_leaves_out_samples_without_a_command() -> None:
    time = np.array([0.0, 1.0, 1.1, 1.2, 2.0])
    command = np.array([1.0, 2.0, 0.0, 2.0, 9.0])
    response = np.array([0.0, 1.9, 5.0, 1.8, 0.0])
    assert steady_state_error(time, response, command, (1.0, 1.2)) == pytest.approx(0.075)
    assert np.isnan(steady_state_error(time, response, command, (3.0, 4.0)))


@pytest.mark.parametrize("error", ERRORS)
@given(residual=signals)
def test_every_error_function_is_even_and_grows(error: str, residual: np.ndarray) -> None:
    value = ERRORS[error].value
    np.testing.assert_allclose(value(residual), value(-residual))
    assert (value(1.1 * residual) >= value(residual)).all()
    assert value(np.zeros(1))[0] == 0.0


@pytest.mark.parametrize("error", ["squared", "huber"])
def test_the_influence_is_half_the_derivative_of_the_cost(error: str) -> None:
    r = np.linspace(-5.0, 5.0, 1001)
    step = 1e-6
    value = ERRORS[error].value
    slope = (value(r + step) - value(r - step)) / (2.0 * step)
    np.testing.assert_allclose(2.0 * influence(r, error)[0], slope, atol=1e-5)


def test_the_smooth_stand_in_of_the_absolute_error_follows_it() -> None:
    r = np.array([-30.0, -3.0, 3.0, 30.0])
    np.testing.assert_allclose(influence(r, "absolute")[0] / 0.1, np.sign(r), atol=2e-3)


def test_huber_bounds_the_pull_of_an_outlier() -> None:
    clean, spoilt = np.full(100, 0.5), np.full(100, 0.5)
    spoilt[3] = 1e3
    extra = {e: error_terms({"i": spoilt}, e)["i"] - error_terms({"i": clean}, e)["i"] for e in ERRORS}
    assert extra["squared"] > 9e5
    assert extra["huber"] < 3e3
    assert extra["absolute"] < 1e3


@given(signals)
def test_terms_of_channels_add_up(residual: np.ndarray) -> None:
    half = residual.size // 2
    parts = error_terms({"a": residual[:half], "b": residual[half:]})
    assert sum(parts.values()) == pytest.approx(error_terms({"a": residual})["a"], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("error", ERRORS)
def test_a_residual_that_is_not_finite_costs_infinitely_much(error: str, bad: float) -> None:
    assert error_terms({"i": np.array([0.0, bad])}, error) == {"i": np.inf}


def test_window_mask_counts_both_ends() -> None:
    time = np.array([0.0, 0.1, 0.2, 0.3])
    assert window_mask(time, 0.1, 0.2).tolist() == [False, True, True, False]
    assert window_mask(time).all()


def test_control_cost_is_the_sum_of_its_terms() -> None:
    time = np.linspace(0.0, 2.0, 2001)
    command = np.clip(time / 0.3, 0.0, 1.0) * 9e-3
    response = 0.99 * command
    cost = control_cost(
        time, response, command, kappa_rise=10.0, kappa_steady=100.0, window=(1.0, 1.2), scale=1e-3
    )
    assert cost.tracking == pytest.approx(np.sum(0.5 * (0.01 * command / 1e-3) ** 2))
    assert cost.rise_time == pytest.approx(0.3 * 0.95 / 0.99, abs=1e-6)
    assert cost.steady_state_error == pytest.approx(0.01)
    assert cost.total == pytest.approx(cost.tracking + 10.0 * cost.rise_time + 1.0)
    never = control_cost(time, 0.5 * command, command, kappa_rise=1.0, kappa_steady=1.0, window=(1.0, 1.2))
    assert never.total == np.inf


@pytest.mark.parametrize(
    ("name", "rise", "steady"),
    [("tuned_at_25", (0.42, 0.45), (0.0015, 0.0025)), ("optimized", (0.295, 0.305), (-3e-4, 3e-4))],
)
def test_table_4_of_the_article(name: str, rise: tuple[float, float], steady: tuple[float, float]) -> None:
    path = TABLE4 / f"{name}.csv"
    if not path.exists():
        pytest.skip("the recordings of table IV are not beside this repository")
    table = pd.read_csv(path)
    time = table["time_s"].to_numpy()
    speed, command = table["velocity_mm_s"].to_numpy(), table["velocity_command_mm_s"].to_numpy()
    assert rise[0] < first_reach(time, speed, command[-1], 0.95) < rise[1]
    assert steady[0] < steady_state_error(time, speed, command, (1.0, 1.2)) < steady[1]
