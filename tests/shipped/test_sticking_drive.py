"""A simulated drive whose cogging makes it stick and slip: found with the model kept in step."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from thsa_cosim.cli import run_command
from thsa_cosim.diagnosis import known_effects
from thsa_cosim.diagnosis.catalogue.superset import build_superset
from thsa_cosim.diagnosis.choosing.in_step import InStep
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.fmu import Plant
from thsa_cosim.signals import Signals

ROOT = Path(__file__).parents[2]
ORDER, SINE, COSINE = 24.0, -0.2, 0.35
TRUE = {
    "motorEffect.cogging.a_s": SINE,
    "motorEffect.cogging.a_c": COSINE,
    "motorEffect.cogging.n": ORDER,
    "motor.J": 2.06e-3,
    "velocityController.K_p": 0.12,
    "velocityController.K_i": 0.45,
}
#: Signal: column, factor from SI, noise in the column's unit.
COLUMNS = {
    "v": ("velocity_mm_s", 1e3, 0.02),
    "x": ("position_mm", 1e3, 1e-3),
    "w_m": ("motor_speed_rad_s", 1.0, 0.2),
    "i_q": ("q_current_A", 1.0, 0.05),
    "u_q": ("q_voltage_V", 1.0, 0.3),
}


def record(plant: Plant, file: Path, speeds: list[float], seed: int) -> None:
    """A recording at levels of speed (m/s), 1.2 s each, there and back, in steps of the load."""
    levels = [0.0, *speeds, 0.0, *(-s for s in speeds), 0.0]
    time = np.arange(int(1200 * len(levels)) + 1) * 1e-3
    corners = np.ravel([[1.2 * k + 0.2, 1.2 * k + 1.2] for k in range(len(levels))])
    command = np.interp(time, corners, np.repeat(levels, 2))
    load = np.interp(time, corners, np.repeat(np.linspace(1e4, 4e4, len(levels)), 2))
    inputs = Signals(time, {"v_cmd": command, "F_load": load, "T_amb": np.full(time.size, -40.0)})
    run = plant.run(TRUE, inputs, tuple(COLUMNS), time, tolerance=1e-8)
    draw = np.random.default_rng(seed)
    table = {"time_s": time, "velocity_command_mm_s": 1e3 * command}
    table |= {c: f * run[n] + s * draw.standard_normal(time.size) for n, (c, f, s) in COLUMNS.items()}
    table["load_kN"] = 1e-3 * load + 0.06 * draw.standard_normal(time.size)
    table["temperature_degC"] = -40.0 + 0.2 * draw.standard_normal(time.size)
    pd.DataFrame(table).to_parquet(file)


@pytest.mark.nightly
def test_a_cogging_that_makes_the_shaft_stick_is_found_in_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The free run finds this one by itself: that is left out, so that the way in step is seen to lead there."""
    monkeypatch.setattr("thsa_cosim.diagnosis.choosing.selection.Selection.is_open", lambda *_: True)
    added = InStep._added

    def only_in_step(self: InStep, stepped: Bench, *rest: Any) -> Any:
        return None if stepped is self.bench else added(self, stepped, *rest)

    monkeypatch.setattr(InStep, "_added", only_in_step)
    effects = [known_effects()["cogging"]]
    fmu, *_ = build_superset("Actuator", ROOT / "modelica" / "THSA", effects, tmp_path / "plant")
    with Plant.open(fmu) as plant:
        for k, speeds in enumerate(([8e-3, 2.5e-3, 7e-4], [6e-3, 1.5e-3, 5e-4], [7e-3, 2e-3, 6e-4])):
            record(plant, tmp_path / f"{k}.parquet", speeds, seed=k)
    files = [str(tmp_path / f"{k}.parquet") for k in range(3)]
    command = ["diagnose", str(ROOT / "scenarios" / "driven.toml"), "--fit", files[0], "--fit", files[1]]
    assert run_command([*command, "--validate", files[2], "-o", str(tmp_path / "study")]) == 0
    found = json.loads((tmp_path / "study" / "result.json").read_text())
    assert any("kept in step" in note for note in found["notes"])
    (effect,) = found["effects"]
    assert effect["name"] == "cogging:motor"
    assert effect["order"] == "24 per turn of the motor"
    values = {name: p["value"] for name, p in effect["parameters"].items()}
    assert values["a_s"] == pytest.approx(SINE, abs=0.02)
    assert values["a_c"] == pytest.approx(COSINE, abs=0.02)
    left = {name: e["rmse"] / e["noise"] for name, e in found["after"]["validate"].items()}
    assert max(left.values()) < 1.1
