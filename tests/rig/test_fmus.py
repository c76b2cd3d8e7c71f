"""The shipped FMUs against the reference plant, which knows nothing of Modelica or FMI."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from reference.radau import MOTOR_OUTPUTS, OUTPUTS, simulate, simulate_motor
from reference.rig import LAWS, Widths, rig_at
from reference.schedules import DRIVEN_A, DRIVEN_A_END, DRIVEN_A_LOAD, RAMP, RAMP_LOAD, samples
from reference.stick import simulate_stick
from reference.waves import Wave, constant

from thsa_cosim.fmu import Plant
from thsa_cosim.signals import Signals

FMUS = Path(__file__).parents[2] / "fmus"
FOLDERS = ("", "fmi3")
WIDTHS = {
    "motor": ("motor.friction.v_r",),
    "gearbox": ("gearbox.friction.v_r", "noBack.w_r"),
    "nut": ("nut.friction.v_r",),
    "hold_current": ("velocityController.I_band",),
    "hold_voltage": ("currentController.U_band",),
}


def plant(name: str, folder: str, kind: str = "co-simulation") -> Plant:
    return Plant.open(FMUS / folder / f"{name}.fmu", kind=kind)


@pytest.fixture(scope="module", params=FOLDERS, ids=["fmi2", "fmi3"])
def actuator(request: pytest.FixtureRequest) -> Iterator[Plant]:
    with plant("THSA", request.param) as opened:
        yield opened


@pytest.fixture(scope="module", params=FOLDERS, ids=["fmi2", "fmi3"])
def motor(request: pytest.FixtureRequest) -> Iterator[Plant]:
    with plant("Motor", request.param) as opened:
        yield opened


def start_of(opened: Plant, name: str) -> float:
    start = opened.description.variable(name).start
    assert start is not None
    return start


def widths_of(opened: Plant) -> Widths:
    """The widths that the FMU declares, so that both plants regularise alike."""
    known = opened.description.variables
    values = {}
    for part, names in WIDTHS.items():
        found = {start_of(opened, name) for name in names if name in known}
        assert len(found) <= 1, f"{names} differ"
        values[part] = found.pop() if found else 1.0
    return Widths(**values)


def inputs(time: np.ndarray, temperature: float, **waves: Wave) -> Signals:
    columns = {name: w.at(time) for name, w in waves.items()}
    held = frozenset(name for name, w in waves.items() if w.hold)
    return Signals(time, {**columns, "T_amb": np.full_like(time, temperature)}, {}, held)


def largest_error(found: Signals, expected: dict[str, np.ndarray]) -> float:
    """Largest deviation over all outputs, each relative to its range."""
    return max(float(np.abs(found[n] - expected[n]).max() / np.ptp(expected[n])) for n in found.names)


HELD = Wave(
    samples(0.45),
    np.round(np.interp(samples(0.45), [0.05, 0.15, 0.25, 0.4], [0.0, 60.0, 60.0, -30.0]), 1),
    hold=True,
)


@cache
def expected_held(widths: Widths) -> dict[str, np.ndarray]:
    return simulate_motor(rig_at(-55.0), HELD, HELD.times, widths, rtol=1e-9)


@cache
def expected_ramp(widths: Widths) -> dict[str, np.ndarray]:
    return simulate(rig_at(-30.0), RAMP, RAMP_LOAD, samples(1.2005), widths)


@cache
def expected_schedule(widths: Widths, temperature: float) -> dict[str, np.ndarray]:
    time = samples(DRIVEN_A_END)
    sampled = (Wave(time, DRIVEN_A.at(time)), Wave(time, DRIVEN_A_LOAD.at(time)))
    # 1e-8 differs from 1e-10 by 2e-9 of range and takes a third of the time
    rtol = 1e-10 if temperature == -55.0 else 1e-8
    return simulate(rig_at(temperature), *sampled, time, widths, rtol=rtol)


def test_start_values_are_those_of_the_rig(actuator: Plant) -> None:
    rig = rig_at(-30.0)
    expected = {
        "velocityController.K_p": rig.K_p,
        "velocityController.K_i": rig.K_i,
        "velocityController.I_max": rig.I_max,
        "currentController.K_pc": rig.K_pc,
        "currentController.K_ic": rig.K_ic,
        "currentController.U_max": rig.U_max,
        "motor.p": rig.p,
        "motor.L": rig.L,
        "motor.J": rig.J,
        "gearbox.i": rig.i,
        "noBack.k_b": rig.k_b,
        "screw.P_h": rig.P_h,
        "screw.k_s": rig.k_s,
        "screw.d_s": rig.d_s,
        "stabilizer.M": rig.M,
        "sensor.tau_v": rig.tau_v,
    }
    assert {name: start_of(actuator, name) for name in expected} == pytest.approx(expected, rel=1e-12)


def test_ramp_of_table_iv(actuator: Plant) -> None:
    """i_q, v and x within 1e-4 of their range; our bound is 1000 times narrower."""
    time = samples(1.2005)
    found = actuator.run({}, inputs(time, -30.0, v_cmd=RAMP, F_load=RAMP_LOAD), OUTPUTS, time)
    assert largest_error(found, expected_ramp(widths_of(actuator))) < 1e-7


def test_widths_are_too_narrow_to_be_seen(actuator: Plant) -> None:
    """Against the rig with true stick, relative to the range: the noise of the position is 1e-4 of it."""
    time = samples(1.2)
    found = actuator.run({}, inputs(time, -30.0, v_cmd=RAMP, F_load=RAMP_LOAD), OUTPUTS, time)
    assert largest_error(found, simulate_stick(rig_at(-30.0), RAMP, RAMP_LOAD, time, rtol=1e-10)) < 6e-6


@pytest.mark.parametrize("temperature", [25.0, -55.0])
def test_driven_schedule_at_rtol_1e_6(actuator: Plant, temperature: float) -> None:
    """Within 1e-5 of range of Radau, and moved by less than 1e-5 by half the communication step."""
    time = samples(DRIVEN_A_END)
    half = np.sort(np.concatenate([time, 0.5 * (time[1:] + time[:-1])]))
    driven = inputs(time, temperature, v_cmd=DRIVEN_A, F_load=DRIVEN_A_LOAD)
    coarse = actuator.run({}, driven, OUTPUTS, time, tolerance=1e-6)
    fine = actuator.run({}, driven, OUTPUTS, half, tolerance=1e-6)
    assert largest_error(coarse, expected_schedule(widths_of(actuator), temperature)) < 1e-5
    assert largest_error(coarse, {name: fine[name][::2] for name in OUTPUTS}) < 1e-5


def test_tolerance_is_honoured(actuator: Plant) -> None:
    time = samples(DRIVEN_A_END)
    driven = inputs(time, 25.0, v_cmd=DRIVEN_A, F_load=DRIVEN_A_LOAD)
    expected = expected_schedule(widths_of(actuator), 25.0)
    loose, tight = (
        largest_error(actuator.run({}, driven, OUTPUTS, time, tolerance=tolerance), expected)
        for tolerance in (1e-4, 1e-8)
    )
    assert tight < 0.1 * loose < 1e-4


def test_communication_step_of_50_ms_changes_nothing(actuator: Plant) -> None:
    """Between kinks of the inputs the FMU steps as it needs, not as it is asked."""
    time = np.arange(24) * 0.05
    found = actuator.run({}, inputs(time, -30.0, v_cmd=RAMP, F_load=RAMP_LOAD), OUTPUTS, time)
    expected = {name: values[::50] for name, values in expected_ramp(widths_of(actuator)).items()}
    assert largest_error(found, expected) < 1e-7


@pytest.mark.parametrize("load", [55e3, -55e3])
@pytest.mark.parametrize("temperature", [25.0, -30.0, -55.0])
def test_rest_under_load_creeps_less_than_10_um_in_10_s(
    actuator: Plant, temperature: float, load: float
) -> None:
    time = np.linspace(0.0, 10.0, 101)
    still = inputs(time, temperature, v_cmd=constant(0.0), F_load=constant(load))
    x = actuator.run({}, still, ("x",), time)["x"]
    assert x[0] == pytest.approx(-load / rig_at(temperature).k_s, rel=1e-12)
    assert np.abs(x - x[0]).max() < 1e-6


def test_saturated_start_with_held_integrators(motor: Plant) -> None:
    """A step of 450 rad/s with stiff gains: current and voltage limits act, and no integrator winds up."""
    rig = rig_at(-30.0, K_p=0.8, K_i=20.0)
    time = samples(0.5)
    step = constant(450.0)
    widths = widths_of(motor)
    found = motor.run(
        {"velocityController.K_p": rig.K_p, "velocityController.K_i": rig.K_i},
        inputs(time, -30.0, w_cmd=step),
        MOTOR_OUTPUTS,
        time,
    )
    expected = simulate_motor(rig, step, time, widths)
    assert expected["u_q"].max() == rig.U_max
    assert expected["i_q"].max() > 0.9 * rig.I_max
    assert largest_error(found, expected) < 1e-5


def test_motor_bench_with_held_commands(motor: Plant) -> None:
    found = motor.run({}, inputs(HELD.times, -55.0, w_cmd=HELD), MOTOR_OUTPUTS, HELD.times, tolerance=1e-8)
    # u_q jumps with the command at each sample; both give the value after the jump
    assert largest_error(found, expected_held(widths_of(motor))) < 1e-6


@pytest.mark.parametrize("folder", FOLDERS, ids=["fmi2", "fmi3"])
@pytest.mark.parametrize("bench", ["Gearbox", "Screw"])
@pytest.mark.parametrize("temperature", [25.0, 0.0, -30.0, -55.0])
def test_component_benches_read_the_static_force(bench: str, folder: str, temperature: float) -> None:
    rig = rig_at(temperature)
    v = np.repeat([0.5, -0.5, 1.0, -2.0, 4.5, -6.0, 9.0, -9.0], 10) * 1e-3
    time = np.arange(len(v)) * 0.01
    with plant(bench, folder) as opened:
        found = opened.run({}, inputs(time, temperature, v=Wave(time, v, hold=True)), ("F",), time)["F"]
    force = rig.F_fn * np.sign(v) + rig.b_n * v
    if bench == "Gearbox":
        force += (rig.T_fg * np.sign(v) + rig.b_g * v / rig.k) / rig.k
    assert found == pytest.approx(force, rel=1e-9)


def test_a_constant_term_alone_gives_the_law_at_one_temperature(motor: Plant) -> None:
    """What an identification at one temperature does: a0 holds the value, the rest of each law is 0."""
    time = samples(0.3)
    command = Wave(np.array([0.0, 0.1]), np.array([0.0, 90.0]))
    values: dict[str, float] = {}
    for name in ("R_s", "psi_pm", "T_fm", "b_m"):
        values |= {f"motor.{name}.{part}": 0.0 for part in ("a1", "a2", "a3", "alpha1", "alpha2")}
        values[f"motor.{name}.a0"] = LAWS[name](-40.0)
    by_law = motor.run({}, inputs(time, -40.0, w_cmd=command), MOTOR_OUTPUTS, time)
    by_constant = motor.run(values, inputs(time, 17.0, w_cmd=command), MOTOR_OUTPUTS, time)
    assert largest_error(by_constant, {name: by_law[name] for name in MOTOR_OUTPUTS}) < 1e-9


def test_model_exchange_gives_the_same_trajectory() -> None:
    time = samples(0.4)
    ramp = inputs(time, -30.0, v_cmd=RAMP, F_load=RAMP_LOAD)
    with plant("THSA", "", "model-exchange") as opened:
        found = opened.run({}, ramp, OUTPUTS, time, tolerance=1e-8)
        expected = expected_ramp(widths_of(opened))
    assert largest_error(found, {name: values[: len(time)] for name, values in expected.items()}) < 1e-6
