"""The reference plant against closed forms, published figures and the recordings."""

from pathlib import Path

import numpy as np
import pytest
from reference.radau import MOTOR_OUTPUTS, OUTPUTS, simulate, simulate_motor, simulate_states
from reference.rig import (
    LAWS,
    NARROW,
    Rig,
    Widths,
    actuator_jacobian,
    actuator_rates,
    actuator_signs,
    drive,
    motor_jacobian,
    motor_rates,
    rig_at,
    sign,
)
from reference.schedules import (
    DRIVEN_A,
    DRIVEN_A_END,
    DRIVEN_A_LOAD,
    DRIVEN_B,
    DRIVEN_B_END,
    DRIVEN_B_LOAD,
    RAMP,
    RAMP_LOAD,
    samples,
)
from reference.stick import simulate_stick
from reference.waves import Wave, constant, wave

RECORDINGS = Path(__file__).parents[3] / "shared" / "recordings"
NOISE = {"v": 2e-5, "x": 1e-6, "w_m": 0.2, "i_q": 0.05, "u_q": 0.3}
QUANTUM = {"v": 5e-6, "x": 1e-6, "w_m": 0.05, "i_q": 0.01, "u_q": 0.1}
COLUMNS = {
    "v": ("velocity_mm_s", 1e-3),
    "x": ("position_mm", 1e-3),
    "w_m": ("motor_speed_rad_s", 1.0),
    "i_q": ("q_current_A", 1.0),
    "u_q": ("q_voltage_V", 1.0),
}


def recording(name: str):
    pd = pytest.importorskip("pandas")
    path = RECORDINGS / name
    if not path.exists():
        pytest.skip(f"{path} is not on this machine")
    return pd.read_csv(path) if path.suffix == ".csv" else pd.read_parquet(path)


def in_noise(found: dict[str, np.ndarray], table) -> dict[str, float]:
    """rms of the residual over the sensor's noise (quantisation included), per channel."""
    score = {}
    for name in set(found) & set(COLUMNS):
        column, factor = COLUMNS[name]
        if column in table:
            residual = found[name] - table[column].to_numpy(float) * factor
            score[name] = float(
                np.sqrt(np.mean(residual**2)) / np.hypot(NOISE[name], QUANTUM[name] / 12**0.5)
            )
    return score


def test_laws_at_minus_30() -> None:
    expected = {
        "R_s": 0.498,
        "psi_pm": 0.0946,
        "T_fm": 0.05610255,
        "b_m": 4.57e-5,
        "T_fg": 18.68,
        "b_g": -6e-6,
        "F_fn": 2220.0,
        "b_n": 337000.0,
    }
    assert {name: law(-30.0) for name, law in LAWS.items()} == pytest.approx(expected, rel=1e-6)


def test_motor_at_constant_speed_draws_friction_over_torque_constant() -> None:
    rig = rig_at(-40.0)
    time = np.array([0.0, 30.0])
    found = simulate_motor(rig, constant(120.0), time, NARROW)
    i_q = (rig.T_fm + rig.b_m * 120.0) / rig.K_t
    assert found["w_m"][-1] == pytest.approx(120.0, rel=1e-9)
    assert found["i_q"][-1] == pytest.approx(i_q, rel=1e-7)
    assert found["u_q"][-1] == pytest.approx(rig.R_s * i_q + rig.K_t * 120.0, rel=1e-9)


@pytest.mark.parametrize("load", [55e3, 5e3, -55e3])
def test_actuator_at_constant_speed_draws_all_torques(load: float) -> None:
    """With opposing load the current carries it; aided, the no-back drag exceeds it by k_b - 1."""
    rig = rig_at(-30.0)
    speed = 6e-3
    found = simulate(rig, wave((0.0, 0.0), (0.3, speed)), constant(load), np.array([0.0, 30.0]), NARROW)
    T_s = rig.k * (rig.F_fn + rig.b_n * speed + load)
    T_g = T_s + rig.T_fg + rig.b_g * speed / rig.k + (rig.k_b * -T_s if T_s < 0 else 0.0)
    w_m = speed * rig.i / rig.k
    assert found["v"][-1] == pytest.approx(speed, rel=1e-6)
    assert found["i_q"][-1] == pytest.approx((T_g / rig.i + rig.T_fm + rig.b_m * w_m) / rig.K_t, rel=1e-6)
    assert found["i_q"][-1] > 0.0


def test_small_steps_of_the_current_loop_follow_its_linear_transfer_function() -> None:
    """A stuck motor is R-L: with the velocity loop off, i_q answers as two poles of the current loop alone."""
    rig = rig_at(0.0, K_p=1e-3, K_i=0.0, T_fm=1.0)
    time = np.linspace(0.0, 0.02, 201)
    found = simulate_motor(rig, constant(10.0), time, Widths(1e-9, 1e-9, 1e-9))
    i_ref = 1e-2
    poles = np.roots([rig.L, rig.R_s + rig.K_pc, rig.K_ic])
    # closed loop (K_pc s + K_ic) / (L s^2 + (R + K_pc) s + K_ic), step response by residues
    residues = [
        i_ref * (rig.K_pc * s + rig.K_ic) / (s * rig.L * (s - other)) for s, other in (poles, poles[::-1])
    ]
    expected = i_ref + sum(r * np.exp(s * time) for r, s in zip(residues, poles, strict=True))
    assert found["i_q"] == pytest.approx(expected.real, abs=1e-7 * i_ref)


def test_saturated_drive_holds_its_integrators() -> None:
    """A step of 60 rad/s at K_p = 1 asks for 60 A: limited to 40 A, then 190 V, both integrators held."""
    rig = rig_at(25.0, K_p=1.0, K_i=50.0, T_fm=0.0, b_m=0.0)
    time = np.linspace(0.0, 4e-4, 41)
    found = simulate_motor(rig, constant(60.0), time, NARROW)
    # with K_pc = 4 the voltage is 160 V at first: 40 A wanted, winding and its integrator linear
    assert found["u_q"][0] == pytest.approx(160.0)
    dz_w, dz_c, _, u_q = drive(rig, NARROW, 60.0, [0.0, 40.0, 0.0, 0.0])
    assert (dz_w, dz_c, u_q) == (0.0, 0.0, 190.0)
    dz_w, dz_c, _, u_q = drive(rig, NARROW, 60.0, [0.0, 0.0, 0.0, 30.0])
    assert (dz_w, u_q) == (pytest.approx(50.0 * 30.0), pytest.approx(4.0 * 30.0))
    assert dz_c == pytest.approx(1000.0 * 30.0)


def random_state(seed: int, size: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    y = rng.normal(size=8) * [30.0, 60.0, 15.0, 100.0, 1.0, 1e-3, 5e-3, 5e-3]
    if seed % 3 == 0:  # inside the regularised bands
        y[3], y[6] = rng.uniform(-2.0, 2.0) * NARROW.motor, rng.uniform(-2.0, 2.0) * NARROW.nut
    y[5] = rig_at(-30.0).k * y[4] + rng.normal() * 2e-4
    return y[:size]


@pytest.mark.parametrize("seed", range(30))
def test_jacobians_are_those_of_the_rates(seed: int) -> None:
    rig = rig_at(-30.0)
    fine = seed % 3 == 0
    steps = np.array([1e-5, 1e-5, 1e-5, 1e-8 if fine else 1e-5, 1e-6, 1e-7, 1e-12 if fine else 1e-7, 1e-6])

    def actuator(y: np.ndarray) -> np.ndarray:
        signs = actuator_signs(rig, NARROW, y.tolist())
        return np.array(actuator_rates(rig, NARROW, y.tolist(), 3e-3, 2e4, signs))

    def motor(y: np.ndarray) -> np.ndarray:
        return np.array(motor_rates(rig, NARROW, y.tolist(), 80.0, sign(y[3], NARROW.motor)))

    for rates, jacobian, n in (
        (actuator, lambda y: actuator_jacobian(rig, NARROW, y.tolist(), 3e-3), 8),
        (motor, lambda y: motor_jacobian(rig, NARROW, y.tolist(), 80.0), 4),
    ):
        y = random_state(seed, n)
        columns = [
            (rates(y + h * e) - rates(y - h * e)) / (2 * h) for h, e in zip(steps, np.eye(n), strict=False)
        ]
        exact = jacobian(y)
        scale = np.maximum(1e-9, np.abs(exact).max(axis=1, keepdims=True))
        assert np.abs(np.column_stack(columns) - exact) / scale == pytest.approx(np.zeros((n, n)), abs=1e-5)


def test_energy_is_conserved() -> None:
    """Electrical input = copper + friction + contact damping + load + what is stored, to 1e-6."""
    rig = rig_at(-30.0)
    v_cmd = wave((0.0, 0.0), (0.1, 6e-3), (0.2, 6e-3), (0.4, -6e-3))
    load = wave((0.0, 2e4), (0.25, 2e4), (0.35, -3e4))
    wide = Widths(motor=0.3, gearbox=0.01, nut=1e-5)  # wide enough for a quadrature on a fixed grid
    time = np.linspace(0.0, 0.5, 100_001)
    y = simulate_states(rig, v_cmd, load, time, wide, rtol=1e-9)
    _, _, i_q, w, theta_g, x, dx, _ = y.T
    command = v_cmd.at(time) * rig.i / rig.k
    u_q = np.array([drive(rig, wide, c, s)[3] for c, s in zip(command.tolist(), y.tolist(), strict=True)])
    w_g = w / rig.i
    s_m, s_g, s_n = (np.clip(a, -1, 1) for a in (w / wide.motor, w_g / wide.gearbox, dx / wide.nut))
    gap = rig.k * theta_g - x
    slip = rig.k * w_g - dx
    T_s = rig.k * (rig.k_s * gap + rig.d_s * slip)
    no_back = rig.k_b * np.maximum(0.0, -T_s * s_g) * s_g
    assert np.abs(no_back * w_g).max() > 10.0  # the no-back device takes part
    losses = (
        rig.R_s * i_q**2
        + (rig.T_fm * s_m + rig.b_m * w) * w
        + (rig.T_fg * s_g + rig.b_g * w_g + no_back) * w_g
        + rig.d_s * slip**2
        + (rig.F_fn * s_n + rig.b_n * dx) * dx
    )
    stored = 0.5 * (rig.L * i_q**2 + rig.J * w**2 + rig.k_s * gap**2 + rig.M * dx**2)
    brought = np.trapezoid(u_q * i_q, time)
    assert np.trapezoid(losses + load.at(time) * dx, time) + stored[-1] - stored[0] == pytest.approx(
        brought, rel=1e-5
    )


def test_regularised_signs_converge_to_true_stick() -> None:
    """The error is proportional to the width, so the reference is the rig's and not the regularisation's."""
    rig, time = rig_at(-30.0), samples(1.2)
    stick = simulate_stick(rig, RAMP, RAMP_LOAD, time, rtol=1e-10)
    errors = []
    for factor in (10.0, 1.0):
        widths = Widths(NARROW.motor * factor, NARROW.gearbox * factor, NARROW.nut * factor)
        found = simulate(rig, RAMP, RAMP_LOAD, time, widths)
        errors.append(np.array([np.abs(found[n] - stick[n]).max() / np.ptp(stick[n]) for n in OUTPUTS]))
    assert errors[1].max() < 6e-5
    assert errors[0] / errors[1] == pytest.approx(np.full(5, 10.0), rel=0.3)


@pytest.mark.parametrize(
    ("gains", "rise", "steady"),
    [((0.12, 0.45), (0.43, 0.4415), (0.0019, 0.00204)), ((0.363, 2.98), (0.29, 0.305), (-3.2e-5, -2.5e-5))],
)
def test_table_iv(gains: tuple[float, float], rise: tuple[float, float], steady: tuple[float, float]) -> None:
    """Rise time to 95 % and mean error over 1.0 to 1.2 s, as published for this rig."""
    rig = rig_at(-30.0, K_p=gains[0], K_i=gains[1])
    time = samples(1.2005)
    v = simulate(rig, RAMP, RAMP_LOAD, time, NARROW)["v"]
    assert rise[0] <= time[np.argmax(v >= 0.95 * 9e-3)] <= rise[1]
    assert steady[0] <= np.mean(1.0 - v[time >= 1.0] / 9e-3) <= steady[1]


def test_rest_under_load_creeps_less_than_the_width_allows() -> None:
    rig = rig_at(25.0)
    time = np.linspace(0.0, 10.0, 11)
    x = simulate(rig, constant(0.0), constant(55e3), time, NARROW)["x"]
    assert x[0] == -55e3 / rig.k_s
    assert 0.0 < abs(x[-1] - x[0]) < NARROW.gearbox * rig.k * 10.0


@pytest.mark.parametrize("gains", [(0.12, 0.45), (0.363, 2.98)])
def test_table_iv_recordings_are_this_rig(gains: tuple[float, float]) -> None:
    table = recording("table4/tuned_at_25.csv" if gains[0] == 0.12 else "table4/optimized.csv")
    rig = rig_at(-30.0, K_p=gains[0], K_i=gains[1])
    time = np.concatenate([[0.0], table.time_s.to_numpy() + 1e-3])
    found = simulate(rig, RAMP, RAMP_LOAD, time, NARROW, rtol=1e-8)
    score = in_noise({name: values[1:] for name, values in found.items()}, table)
    assert len(score) == 5
    assert max(score.values()) < 1.04


@pytest.mark.parametrize(("temperature", "part"), [(25, "a"), (-30, "a"), (-55, "a"), (-55, "b")])
def test_driven_recordings_are_this_rig(temperature: int, part: str) -> None:
    name = f"{'m' if temperature < 0 else 'p'}{abs(temperature):02d}_{part}"
    table = recording(f"driven/{name}.parquet")
    command, load, end = {
        "a": (DRIVEN_A, DRIVEN_A_LOAD, DRIVEN_A_END),
        "b": (DRIVEN_B, DRIVEN_B_LOAD, DRIVEN_B_END),
    }[part]
    time = samples(end + 1e-3)
    assert command.at(time[1:]) * 1e3 == pytest.approx(table.velocity_command_mm_s.to_numpy(float), abs=1e-6)
    found = simulate(rig_at(float(temperature)), command, load, time, NARROW, rtol=1e-6)
    score = in_noise({name: values[1:] for name, values in found.items()}, table)
    assert len(score) == 5
    assert max(score.values()) < 1.025


@pytest.mark.parametrize("name", ["p25", "m55"])
def test_motor_recordings_are_this_rig_under_held_commands(name: str) -> None:
    table = recording(f"bench/motor_{name}.parquet").iloc[:6500]  # up to 20 -> -60 rad/s
    time = table.time_s.to_numpy(float)
    command = Wave(time, np.round(table.speed_command_rad_s.to_numpy(float), 3), hold=True)
    rig: Rig = rig_at({"p25": 25.0, "m55": -55.0}[name])
    found = simulate_motor(rig, command, time, NARROW, rtol=1e-6)
    score = in_noise(found, table)
    assert set(score) == set(MOTOR_OUTPUTS)
    assert max(score.values()) < 1.025
