"""Errors of the phases against closed forms: what the current reads, and how fast the motor turns, at a held angle."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from thsa_cosim.diagnosis import known_effects
from thsa_cosim.diagnosis.catalogue.superset import build_superset
from thsa_cosim.fmu import Plant
from thsa_cosim.signals import Signals

PACKAGE = Path(__file__).parents[3] / "modelica" / "THSA"
NAMES = ("phase-current-offset", "phase-current-gain", "dead-time-ripple")
R, K_T, T_C, B, K_S = 0.3, 0.02, 2e-3, 1e-5, 0.09
ANGLE, VOLTAGE, SPEED = 0.3, 1.0, 20.0
TIME = np.linspace(0.0, 2.0, 401)


@pytest.fixture(scope="module")
def motor(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    folder = tmp_path_factory.mktemp("phases")
    effects = [effect for name, effect in known_effects().items() if name in NAMES]
    fmu, *_ = build_superset("THSA.Examples.BrushlessMotorPhases", PACKAGE, effects, folder)
    with Plant.open(fmu) as plant:
        yield plant


def steady(plant: Plant, effect: str, loop: bool = False, **values: float) -> dict[str, float]:
    """Current and speed once all has settled, on a held voltage or under the speed loop."""
    start = {"R": R, "L": 1e-4, "K_t": K_T, "J": 1e-6, "T_c": T_C, "b": B, "K_s": K_S if loop else 0.0}
    start |= {f"phaseEffect.{effect}.{name}": value for name, value in values.items()}
    inputs = {"u_q": VOLTAGE, "w_ref": SPEED, "phi": ANGLE}
    signals = Signals(TIME, {name: np.full(TIME.size, value) for name, value in inputs.items()})
    found = plant.run(start, signals, ("i_q", "w"), TIME, tolerance=1e-10)
    return {name: float(found[name][-1]) for name in ("i_q", "w")}


def free(du: float = 0.0) -> tuple[float, float]:
    """True current and speed on the held voltage: u + du = R i + K_t w, K_t i = T_c + b w."""
    i, w = np.linalg.solve([[R, K_T], [K_T, -B]], [VOLTAGE + du, T_C])
    return float(i), float(w)


def test_an_offset_is_read_and_does_nothing_to_a_motor_on_a_held_voltage(motor: Plant):
    found = steady(motor, "phaseCurrentOffset", o_s=0.05, o_c=-0.02, n=7.0)
    i, w = free()
    assert found["i_q"] == pytest.approx(i + 0.05 * np.sin(7 * ANGLE) - 0.02 * np.cos(7 * ANGLE), rel=1e-6)
    assert found["w"] == pytest.approx(w, rel=1e-6)


def test_under_a_current_loop_an_offset_is_a_torque(motor: Plant):
    """The loop holds the reading: i_q = K_s (w_ref - w), and the torque is that of i_q less the offset."""
    found = steady(motor, "phaseCurrentOffset", loop=True, o_s=0.05, n=7.0)
    offset = 0.05 * np.sin(7 * ANGLE)
    w = (K_T * (K_S * SPEED - offset) - T_C) / (K_T * K_S + B)
    assert found["w"] == pytest.approx(w, rel=1e-6)
    assert found["i_q"] == pytest.approx(K_S * (SPEED - w), rel=1e-5)


def test_a_gain_error_is_in_proportion_to_the_current(motor: Plant):
    found = steady(motor, "phaseCurrentGain", g_s=0.03, g_c=0.01, n=14.0)
    i, w = free()
    share = 0.03 * np.sin(14 * ANGLE) + 0.01 * np.cos(14 * ANGLE)
    assert found["i_q"] == pytest.approx(i * (1.0 + share), rel=1e-6)
    assert found["w"] == pytest.approx(w, rel=1e-6)


def test_dead_time_takes_its_voltage_against_the_current(motor: Plant):
    found = steady(motor, "deadTimeRipple", u_s=0.1, u_c=0.2, n=42.0)
    i, w = free(-(0.1 * np.sin(42 * ANGLE) + 0.2 * np.cos(42 * ANGLE)))
    assert (found["i_q"], found["w"]) == (pytest.approx(i, rel=1e-6), pytest.approx(w, rel=1e-6))
