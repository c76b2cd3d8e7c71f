"""A diagnosis of a simulated drive whose spring is known: it is fitted, kept, and not found again."""

import json
from pathlib import Path

import numpy as np
import pytest

from thsa_cosim.cli import run_command
from thsa_cosim.fmu import Plant
from thsa_cosim.recordings.parquet_file import write_columns
from thsa_cosim.signals import Signals

ROOT = Path(__file__).parents[2]
STIFFNESS = 150.0  # N/m
SCENARIO = """
kind = "diagnose"
fmu = "{root}/fmus/EMPS.fmu"

[recordings]
fit = ["fit.parquet"]
validate = ["validate.parquet"]

[recordings.time]
column = "t"
unit = "s"

[recordings.columns.q_ref]
column = "q_ref"
unit = "m"

[recordings.columns.F_load]
value = 0.0
unit = "N"

[recordings.columns.F]
column = "F"
unit = "N"

[diagnose]
model = "THSA.Examples.EMPS"
package = "{root}/modelica/THSA"
effects = ["spring", "asymmetric-friction", "windage"]
spread = 0.3
{known}
[[parameters]]
name = "M"
variable = "M"
unit = "kg"
lower = 30.0
upper = 300.0

[[parameters]]
name = "F_c"
variable = "F_c"
unit = "N"
lower = 0.0
upper = 100.0
"""


def record(plant: Plant, file: Path, frequencies: tuple[float, float], seed: int) -> None:
    time = np.arange(6001) * 1e-3
    start = np.minimum(time, 1.0) ** 2
    q_ref = start * sum(0.05 * np.sin(2.0 * np.pi * f * time) for f in frequencies)
    values = {"c": STIFFNESS, "M": 100.0, "F_c": 18.0}
    run = plant.run(values, Signals(time, {"q_ref": q_ref, "F_load": 0.0 * time}), ("F",), time)
    noise = np.random.default_rng(seed).normal(0.0, 0.3, time.size)
    write_columns(file, {"t": time, "q_ref": q_ref, "F": run["F"] + noise}, {})


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False])
def test_a_known_spring_is_fitted_and_no_missing_effect(known: bool, tmp_path: Path) -> None:
    with Plant.open(ROOT / "fmus" / "EMPS.fmu") as plant:
        record(plant, tmp_path / "fit.parquet", (0.31, 0.83), 1)
        record(plant, tmp_path / "validate.parquet", (0.23, 1.1), 2)
    table = '\n[diagnose.known."spring:guide"]\nc = 40.0\n' if known else ""
    scenario = tmp_path / "drive.toml"
    scenario.write_text(SCENARIO.format(root=ROOT.as_posix(), known=table), encoding="utf-8")
    assert run_command(["diagnose", str(scenario), "-o", str(tmp_path / "study"), "--workers", "1"]) == 0
    result = json.loads((tmp_path / "study" / "result.json").read_text())
    if not known:
        assert [e["name"] for e in result["effects"]] == ["spring:guide"]
        assert result["known"] == []
        return
    assert result["verdict"] == "no-missing-effect"
    assert result["effects"] == []
    (spring,) = result["known"]
    found = spring["parameters"]["c"]
    assert found["value"] == pytest.approx(STIFFNESS, abs=4.0 * found["stderr"])
    assert found["stderr"] < 0.02 * STIFFNESS
    assert result["parameters"]["after"]["guideEffect.spring.c"]["value"] == found["value"]
    assert result["before"]["validate"]["F"]["rmse"] < 0.33  # N, the noise is 0.3
