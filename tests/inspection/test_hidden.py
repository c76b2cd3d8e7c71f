"""A gain of a sensor that the parameters take up: named against the drawing, and only if that says so."""

import numpy as np
import pytest

from thsa_cosim.inspection import Expected, Residual, hidden_gains
from thsa_cosim.inspection.misfit import own_delay

SPEED = np.linspace(-0.01, 0.01, 2000)
DRAWN = {"F_c": 2000.0, "b": 3e5}


def fitted(gain: float, drawn: dict[str, float], offset: float = 0.0) -> list[tuple[str, str]]:
    """Coulomb and viscous friction, fitted to a force whose sensor has ``gain``."""
    columns = np.column_stack((np.sign(SPEED), SPEED))
    noise = 60.0
    true = columns @ np.array(list(DRAWN.values())) + offset
    force = gain * true + np.random.default_rng(3).normal(0.0, noise, SPEED.size)
    value, *_ = np.linalg.lstsq(columns, force, rcond=None)
    stderr = noise * np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    simulated = columns @ value
    residual = Residual(
        "run",
        "F",
        (simulated - force) / noise,
        noise,
        "N",
        {},
        np.arange(SPEED.size) * 1e-2,
        simulated,
        columns / noise,
    )
    known = [
        Expected(name, "", float(v), float(s), drawn.get(name), 1.0)
        for name, v, s in zip(DRAWN, value, stderr, strict=True)
    ]
    return [(f.severity, f.text) for f in hidden_gains([residual], known)]


@pytest.mark.parametrize("gain", [0.9, 1.05])
def test_a_gain_that_all_parameters_show_is_a_warning(gain: float) -> None:
    ((severity, text),) = fitted(gain, DRAWN)
    assert severity == "warning"
    assert f"a gain of {gain:.3g}" in text
    assert "F_c" in text
    assert "b by" in text


def test_a_gain_that_one_parameter_shows_is_a_note() -> None:
    ((severity, _),) = fitted(1.05, {"F_c": 2000.0})
    assert severity == "note"


def test_there_is_no_doubt_without_a_gain_or_a_drawing() -> None:
    assert fitted(1.0, DRAWN) == []
    assert fitted(1.05, {}) == []


def test_parameters_that_differ_in_another_way_doubt_no_sensor() -> None:
    assert fitted(1.0, {"F_c": 1800.0, "b": 3.4e5}) == []


def test_a_gain_is_not_named_by_one_value_against_another() -> None:
    # A speed that reads 5 % too much, with most of the viscous friction declared: b alone takes it up.
    read, noise = 1.05 * SPEED, 60.0
    columns = np.column_stack((np.sign(read), read))
    declared = DRAWN["b"] * read
    force = (
        2000.0 * np.sign(SPEED) + DRAWN["b"] * SPEED + np.random.default_rng(3).normal(0.0, noise, SPEED.size)
    )
    value, *_ = np.linalg.lstsq(columns, force - declared, rcond=None)
    stderr = noise * np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    simulated = declared + columns @ value
    left, time = (simulated - force) / noise, np.arange(SPEED.size) * 1e-2
    residual = Residual("run", "F", left, noise, "N", {}, time, simulated, columns / noise)
    known = [
        Expected(name, "", float(v), float(s), drawn, 1.0)
        for name, v, s, drawn in zip(DRAWN, value, stderr, (2000.0, 1.0), strict=True)
    ]
    assert known[1].value == pytest.approx(-14286.0, rel=0.1)
    assert list(hidden_gains([residual], known)) == []


def test_a_delay_is_no_finding_below_what_the_sampling_makes() -> None:
    time = np.arange(1000) * 1e-3
    slow = np.sin(time)
    assert own_delay(time, slow) == pytest.approx(0.3e-3)
    assert own_delay(time, np.sign(np.sin(30.0 * time))) == pytest.approx(1e-3)  # as fast as the sampling
    lost = time[np.random.default_rng(1).random(1000) > 0.4]
    assert own_delay(lost, np.sin(lost)) > 1.5e-3  # (1 + p) / (1 - p) steps, p = 0.4
    assert own_delay(time, slow, held=True) == pytest.approx(1e-3)  # a step was anywhere between two samples
