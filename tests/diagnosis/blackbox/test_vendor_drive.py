"""A diagnosis of a vendor's drive without source: plain friction at its load, and what its communication step costs."""

import json
from pathlib import Path

import numpy as np
import pytest
from fmu_sources.build import drive2

from thsa_cosim.cli import run_command
from thsa_cosim.fmu import Plant
from thsa_cosim.signals import Signals

NOISE = {"w": 0.02, "phi": 0.002, "i": 0.01}
SCENARIO = """
kind = "diagnose"
fmu = "{fmu}"

[recordings]
fit = ["fit.csv"]
validate = ["validate.csv"]
[recordings.time]
column = "t"
unit = "s"
{columns}
[cost.channels.w]
noise = 0.02
[cost.channels.phi]
noise = 0.002
[cost.channels.i]
noise = 0.01

[[parameters]]
name = "J"
variable = "J"
unit = "kg.m2"
lower = 0.005
upper = 0.08
start = 0.02

[diagnose]
command = "w_cmd"
load = "tau_load"
most = 2
{effects}
[diagnose.blackbox]
speed = "w"
position = "phi"
motor_speed = "w"
current = "i"
"""


def record(folder: Path, name: str, fmu: Path, hidden: dict[str, float], step: float, seed: int) -> None:
    """Four seconds there and back, slow, fast and standing, under two loads."""
    time = np.arange(round(4.0 / step) + 1) * step
    rng = np.random.default_rng(seed)
    corners = np.array([0.0, 0.2, 0.5, 1.1, 1.3, 1.6, 1.9, 2.5, 2.8, 3.1, 3.3, 3.8, 4.0])
    heights = np.array([0.0, 0.0, 8.0, 8.0, 0.0, 0.0, -20.0, -20.0, 0.0, 2.0, 2.0, -2.0, 0.0])
    command = np.interp(time, corners, heights * rng.uniform(0.8, 1.2, heights.size))
    load = np.interp(time, [0.0, 2.2, 2.3, 4.0], [0.3, 0.3, -0.2, -0.2])
    inputs = Signals(time, {"w_cmd": command, "tau_load": load})
    with Plant.open(fmu) as plant:
        plant.input_mode = "mean"
        found = plant.run(hidden, inputs, tuple(NOISE), time)
    columns = [time, command, load, *(found[n] + rng.normal(0.0, s, time.size) for n, s in NOISE.items())]
    header = ",".join(["t", "w_cmd", "tau_load", *NOISE])
    np.savetxt(folder / name, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.9g")


def diagnosed(
    folder: Path, fmu: Path, hidden: dict[str, float], step: float = 0.004, effects: str = ""
) -> dict:
    for number, name in enumerate(("fit.csv", "validate.csv")):
        record(folder, name, fmu, hidden, step, number)
    units = {"w_cmd": "rad/s", "tau_load": "N.m", "w": "rad/s", "phi": "rad", "i": "A"}
    columns = "\n".join(f'[recordings.columns.{n}]\ncolumn = "{n}"\nunit = "{u}"' for n, u in units.items())
    path = folder / "vendor.toml"
    path.write_text(SCENARIO.format(fmu=fmu, columns=columns, effects=effects))
    assert run_command(["diagnose", str(path), "-o", str(folder / "study")]) == 0
    return json.loads((folder / "study" / "result.json").read_text())


@pytest.mark.slow
def test_what_half_the_step_changes_is_a_reason_not_to_trust_a_diagnosis(tmp_path: Path) -> None:
    """The recordings are the FMU's own, so that what is left is noise: only half the step shows what it costs."""
    result = diagnosed(tmp_path, drive2("EULER"), {}, step=0.02, effects='effects = ["velocity-sensor-gain"]')
    change = result["coupling"]["halved"]["i"]
    assert change["noise"] == 0.01
    assert change["rms"] > 0.5 * change["noise"]
    (note,) = [n for n in result["notes"] if n.startswith("WARNING: halving the communication steps")]
    assert "times its noise (fit), which may move a value by up to" in note
    assert note.endswith("; lower simulation.step")
    assert result["trust"]["verdict"] == "not-explained"
    assert note.removeprefix("WARNING: ") in result["trust"]["reasons"]


@pytest.mark.nightly
def test_coulomb_and_viscous_friction_of_the_load_are_found_beside_each_other(tmp_path: Path) -> None:
    """What is left, 1.6 times the noise of the current, is how the load breaks away: a wrapper's approximation."""
    effects = 'effects = ["plain-friction", "stribeck", "windage"]'
    result = diagnosed(tmp_path, drive2(), {"tau_c": 0.15, "b": 0.01, "J": 0.021}, effects=effects)
    (effect,) = result["effects"]
    assert effect["name"] == "plain-friction:load"
    for name, true in (("F_C", 0.15), ("b", 0.01)):
        found = effect["parameters"][name]
        assert abs(found["value"] - true) < 3.0 * found["stderr"] < 0.03 * true
    inertia = result["parameters"]["after"]["J"]
    assert abs(inertia["value"] - 0.021) < 1e-4 * 0.021 + 3.0 * inertia["stderr"]
    held_out = {n: e["rmse"] / e["noise"] for n, e in result["after"]["validate"].items()}
    assert result["before"]["validate"]["i"]["rmse"] > 40.0 * NOISE["i"]
    assert held_out["i"] < 2.0
    assert max(held_out["w"], held_out["phi"]) < 1.2
