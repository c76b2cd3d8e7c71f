"""Start values of states as unknowns of a recording that begins in motion; a recording that shows nothing."""

import json
from pathlib import Path

import pandas as pd
import pytest

from thsa_cosim.cli import run_command

SCENARIOS = Path(__file__).parents[2] / "scenarios"
STATES = (
    ("w_0", "motor.w_m", "rad/s", 30.0, 80.0),
    ("i_0", "motor.i_q", "A", -3.0, 3.0),
    ("z_w", "velocityController.z", "rad", -5.0, 5.0),
    ("z_i", "currentController.z", "A.s", -0.1, 0.1),
)
TEMPERATURE = -30.0
R_S = 1.2 + 3e-2 * TEMPERATURE + 7e-5 * TEMPERATURE**2 - 5e-6 * TEMPERATURE**3
PSI_PM = 0.1 + 6e-5 * TEMPERATURE - 4e-6 * TEMPERATURE**2


def identified(folder: Path, first: float, last: float, states: bool) -> dict:
    """``result.json`` of the motor bench with the rows from ``first`` to ``last`` s of one recording."""
    table = pd.read_parquet(SCENARIOS / "recordings" / "motor_m30.parquet").astype(float)
    cut = folder / "cut.csv"
    table[table["time_s"].between(first, last)].to_csv(cut, index=False)
    text = (SCENARIOS / "motor.toml").read_text().replace('"../fmus/', f'"{SCENARIOS.parent}/fmus/')
    tables = [
        f'[[parameters]]\nname = "{name}"\nvariable = "{variable}"\nunit = "{unit}"\nlower = {lower}\nupper = {upper}\n'
        f'start = {55.0 if name == "w_0" else 0.0}\nper = "recording"\n'
        for name, variable, unit, lower, upper in (STATES if states else ())
    ]
    scenario = folder / "motor.toml"
    scenario.write_text(
        text.replace("# Every channel counts", "\n".join(tables) + "\n# Every channel counts")
    )
    study = folder / "study"
    assert run_command(["identify", str(scenario), "--fit", str(cut), "-o", str(study), "--no-report"]) == 0
    return json.loads((study / "result.json").read_text())


@pytest.mark.slow
def test_start_values_that_are_unknowns_restore_the_parameters(tmp_path: Path) -> None:
    result = identified(tmp_path, 1.5, 9.8, states=True)
    found = result["points"][0]["parameters"]
    for name, true in (("R_s", R_S), ("psi_pm", PSI_PM)):
        assert abs(found[name]["value"] - true) < 3.5 * found[name]["stderr"], name
    assert found["w_0[cut]"]["value"] == pytest.approx(
        55.3, abs=0.5
    )  # measured: 55.05, with 0.2 rad/s of noise
    assert result["trust"]["verdict"] == "explained"


@pytest.mark.slow
def test_a_recording_that_determines_nothing_is_not_explained(tmp_path: Path) -> None:
    result = identified(tmp_path, 0.0, 0.39, states=False)
    assert not any(p["identifiable"] for p in result["points"][0]["parameters"].values())
    assert result["trust"]["verdict"] == "not-explained"
    assert "determine no parameter" in result["trust"]["reasons"][0]
