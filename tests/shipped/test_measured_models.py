"""The classes of measured machines against closed forms and an independent integration."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from thsa_cosim.fmu import Plant
from thsa_cosim.signals import Signals

FMUS = Path(__file__).parents[2] / "fmus"
TIME = np.linspace(0.0, 2.0, 401)


def test_a_servo_without_torque_is_a_damped_pendulum():
    values = {"q_start": 1.2, "T_c": 0.0, "b": 0.01, "J": 0.002, "phi_0": 0.05}
    drive = Signals(TIME, {"q_ref": np.ones(401), "U_in": np.full(401, 7.0), "on": np.zeros(401)})
    with Plant.open(FMUS / "Servo.fmu") as plant:
        run = plant.run(values, drive, ("q", "i"), TIME)

    def fall(_: float, y: np.ndarray) -> list[float]:
        return [y[1], (-0.49 * 9.80665 * 0.1 * np.sin(y[0] + 0.05) - 0.01 * y[1]) / (0.002 + 0.49 * 0.01)]

    known = solve_ivp(fall, (0.0, 2.0), [1.2, 0.0], t_eval=TIME, rtol=1e-9, atol=1e-9).y[0]
    np.testing.assert_allclose(run["q"], known, atol=2e-5)
    np.testing.assert_allclose(run["i"], 0.0, atol=1e-9)


def test_a_servo_holds_where_the_motor_balances_gravity():
    """At rest R i = u, K_t i = m g l sin(q): the position error that a proportional law leaves."""
    time = np.linspace(0.0, 6.0, 601)
    drive = Signals(time, {"q_ref": np.full(601, 0.6), "U_in": np.full(601, 7.0), "on": np.ones(601)})
    with Plant.open(FMUS / "Servo.fmu") as plant:
        run = plant.run({"T_c": 0.0, "controller.k_P": 200.0}, drive, ("q", "duty", "i"), time)
    q, duty, i = (float(run[n][-1]) for n in ("q", "duty", "i"))
    assert duty == pytest.approx(200 / 256 * 4096 / (2 * np.pi) * (0.6 - q), rel=1e-6)
    assert i == pytest.approx(duty / 885 * 7.0 / 3.4, rel=1e-4)
    assert 0.354 * i == pytest.approx(0.49 * 9.80665 * 0.1 * np.sin(q), rel=1e-4)


def test_a_brushless_motor_settles_where_volts_and_friction_say():
    drive = Signals(TIME, {"u_q": np.ones(401), "w_ref": np.zeros(401), "phi": np.linspace(0.0, 100.0, 401)})
    values = {"K_t": 0.019, "R": 0.3, "J": 1e-5, "T_c": 1.7e-3, "w_start": 20.0}
    with Plant.open(FMUS / "BrushlessMotor.fmu") as plant:
        run = plant.run(values, drive, ("w", "i_q"), TIME)
    assert run["w"][0] == pytest.approx(20.0)
    assert run["i_q"][-1] == pytest.approx(1.7e-3 / 0.019, rel=1e-4)
    assert run["w"][-1] == pytest.approx((1.0 - 0.3 * 1.7e-3 / 0.019) / 0.019, rel=1e-4)


def test_a_speed_loop_leaves_the_error_that_friction_needs():
    drive = Signals(
        TIME, {"u_q": np.zeros(401), "w_ref": np.full(401, 6.28), "phi": np.linspace(0.0, 12.0, 401)}
    )
    values = {"K_t": 0.019, "K_s": 0.09, "J": 1e-5, "T_c": 1.7e-3}
    with Plant.open(FMUS / "BrushlessMotor.fmu") as plant:
        run = plant.run(values, drive, ("w", "i_q"), TIME)
    assert run["w"][-1] == pytest.approx(6.28 - 1.7e-3 / 0.019 / 0.09, rel=1e-4)
    np.testing.assert_allclose(run["i_q"], 0.09 * (6.28 - run["w"]), atol=1e-9)
