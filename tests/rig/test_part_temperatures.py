"""Temperatures of parts: given ones against the reference rig, computed ones against an independent network."""

from pathlib import Path

import numpy as np
import pytest
from reference.radau import OUTPUTS, simulate
from reference.rig import LAWS, NARROW, Rig
from reference.schedules import RAMP, RAMP_LOAD, samples
from scipy.integrate import solve_ivp

from thsa_cosim.fmu import Plant
from thsa_cosim.signals import Signals

FMUS = Path(__file__).parents[2] / "fmus"
PARTS = ("winding", "motor", "gearbox", "screw")
TIME = samples(1.2005)


def run(
    name: str, time: np.ndarray, outputs: tuple[str, ...], values: dict | None = None, **columns
) -> Signals:
    signals = {n: np.broadcast_to(np.asarray(c, dtype=float), time.shape) for n, c in columns.items()}
    with Plant.open(FMUS / f"{name}.fmu") as opened:
        return opened.run(values or {}, Signals(time, signals), outputs, time, tolerance=1e-8)


def test_without_their_own_temperatures_all_parts_are_at_that_of_the_box() -> None:
    load = {"v_cmd": RAMP.at(TIME), "F_load": RAMP_LOAD.at(TIME)}
    box = run("THSA", TIME, OUTPUTS, **load, T_amb=-30.0)
    parts = run("THSA", TIME, OUTPUTS, **load, T_amb=17.0, T_motor=-30.0, T_gearbox=-30.0, T_screw=-30.0)
    assert all(np.array_equal(box[name], parts[name]) for name in OUTPUTS)


def test_each_part_follows_its_own_temperature() -> None:
    """Laws of motor, gearbox and screw at three temperatures, against the rig integrated by SciPy."""
    at = {
        "R_s": 0.0,
        "psi_pm": 0.0,
        "T_fm": 0.0,
        "b_m": 0.0,
        "T_fg": -20.0,
        "b_g": -20.0,
        "F_fn": -40.0,
        "b_n": -40.0,
    }
    rig = Rig(**{name: LAWS[name](t) for name, t in at.items()})
    load = {"v_cmd": RAMP.at(TIME), "F_load": RAMP_LOAD.at(TIME)}
    found = run("THSA", TIME, OUTPUTS, **load, T_amb=25.0, T_motor=0.0, T_gearbox=-20.0, T_screw=-40.0)
    expected = simulate(rig, RAMP, RAMP_LOAD, TIME, NARROW)
    for name in OUTPUTS:
        assert np.abs(found[name] - expected[name]).max() < 1e-6 * np.ptp(expected[name]), name


def test_an_input_has_its_declared_start_value_until_it_is_set() -> None:
    with Plant.open(FMUS / "THSA.fmu") as opened:
        declared = {v.name: v.start for v in opened.description.inputs}
        found = opened.run({}, None, tuple(declared), np.array([0.0, 1e-3]))
    assert declared["T_amb"] == 25.0
    assert {name: found[name][0] for name in declared} == declared


C = {"copper": 400.0, "iron": 4000.0, "train": 8000.0, "spindle": 20000.0}


def network(T: np.ndarray, T_amb: float, losses: np.ndarray) -> np.ndarray:
    """dT/dt (4,) of copper, iron, train, spindle in K/s for losses (4,) in W; the declared conductances in W/K."""
    copper, iron, train, spindle = T
    slot, flange, shaft = 8.0 * (copper - iron), 4.0 * (iron - train), 3.0 * (train - spindle)
    flows = [
        -slot,
        slot - flange - 3.0 * (iron - T_amb),
        flange - shaft - 5.0 * (train - T_amb),
        shaft - 8.0 * (spindle - T_amb),
    ]
    return (losses + np.array(flows)) / np.array(list(C.values()))


def test_soaked_parts_follow_a_chamber_that_warms_up() -> None:
    time = np.linspace(0.0, 3000.0, 301)
    T_amb = np.interp(time, [0.0, 1200.0], [-55.0, 25.0])
    found = run(
        "THSA_Thermal", time, tuple(f"temperatures.{p}" for p in PARTS), v_cmd=0.0, F_load=0.0, T_amb=T_amb
    )
    expected = solve_ivp(
        lambda t, T: network(T, float(np.interp(t, [0.0, 1200.0], [-55.0, 25.0])), np.zeros(4)),
        (0.0, 3000.0),
        np.full(4, -55.0),
        t_eval=time,
        rtol=1e-9,
        max_step=10.0,
    ).y
    for row, part in zip(expected, PARTS, strict=True):
        assert found[f"temperatures.{part}"] == pytest.approx(row, abs=1e-4), part
    assert found["temperatures.screw"][-1] < found["temperatures.motor"][-1] < 25.0


def test_losses_warm_their_parts_and_no_heat_is_lost() -> None:
    """What the losses put in is in the parts or has left for the surroundings."""
    time = np.arange(6001) * 1e-2
    wave = np.interp(time % 8.0, [0.0, 0.4, 3.6, 4.4, 7.6, 8.0], [0.0, 9e-3, 9e-3, -9e-3, -9e-3, 0.0])
    inside = ("P_winding", "P_motor", "P_gearbox", "P_screw")
    names = tuple(f"temperatures.{n}" for n in (*PARTS, *inside))
    found = run("THSA_Thermal", time, names, v_cmd=wave, F_load=55e3, T_amb=-30.0)
    T = np.array([found[f"temperatures.{p}"] for p in PARTS])
    heat = float(np.trapezoid(sum(found[f"temperatures.{p}"] for p in inside), time))
    stored = float(np.array(list(C.values())) @ (T[:, -1] - T[:, 0]))
    air = float(np.trapezoid(np.array([0.0, 3.0, 5.0, 8.0]) @ (T + 30.0), time))
    assert heat > 1e4
    assert stored + air == pytest.approx(heat, rel=2e-4)  # the trapezoids' error at the reversals
    assert T[0, -1] > T[1, -1] > -30.0


def test_a_measured_temperature_holds_and_the_network_computes_the_others() -> None:
    time = np.linspace(0.0, 600.0, 61)
    T_motor = np.interp(time, [0.0, 600.0], [-30.0, 0.0])
    names = tuple(f"temperatures.{p}" for p in PARTS)
    found = run("THSA_Thermal", time, names, v_cmd=0.0, F_load=0.0, T_amb=-30.0, T_motor=T_motor)
    assert found["temperatures.motor"] == pytest.approx(T_motor, abs=1e-9)
    lag = C["copper"] / 8.0  # s, of the copper behind a ramp
    late = time > 8.0 * lag
    assert (T_motor - found["temperatures.winding"])[late] == pytest.approx(0.05 * lag, rel=1e-3)
    assert -30.0 < found["temperatures.screw"][-1] < found["temperatures.gearbox"][-1] < 0.0
