"""The shipped examples on measured machines, from the scenario to the verdict."""

import json
from pathlib import Path
from typing import Any

import pytest

from thsa_cosim.cli import run_command

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def diagnosed(name: str, folder: Path) -> dict[str, Any]:
    assert run_command(["diagnose", str(SCENARIOS / f"{name}.toml"), "-o", str(folder)]) == 0
    return dict(json.loads((folder / "result.json").read_text()))


def ratio(result: dict[str, Any], channel: str) -> float:
    return float(result["after"]["validate"][channel]["rmse"] / result["before"]["validate"][channel]["rmse"])


@pytest.mark.nightly
def test_the_servo_loses_a_share_of_its_load(tmp_path: Path) -> None:
    """K_t and R against the published values of model m6: 0.366 N.m/A and 2.81 ohm."""
    found = diagnosed("servo", tmp_path / "servo")
    assert found["effects"][0]["name"] == "load-dependent-friction:gear"
    values = {name: p["value"] for name, p in found["parameters"]["after"].items()}
    assert values["K_t"] == pytest.approx(0.366, rel=0.15)
    assert values["R"] == pytest.approx(2.81, rel=0.15)
    assert ratio(found, "q") < 0.6
    assert found["verdict"] == "unexplained-structure"
    assert any("times the noise in q on held-out recordings: the standard" in note for note in found["notes"])


@pytest.mark.nightly
def test_the_motor_has_cogging(tmp_path: Path) -> None:
    found = diagnosed("cogging", tmp_path / "cogging")
    assert found["effects"][0]["name"] == "cogging:motor"
    assert found["effects"][0]["order"] == "12, 36 per turn of the motor"
    assert ratio(found, "i_q") < 0.5


@pytest.mark.nightly
def test_compensation_is_a_change_of_the_cogging(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = diagnosed("cogging_speed", tmp_path / "before")
    assert before["effects"][0]["name"] == "cogging:motor"
    extended = str(tmp_path / "before" / "extended.toml")
    for name in ("before", "after"):
        file = SCENARIOS / "recordings" / f"cogging_{name}.parquet"
        assert (
            run_command(["identify", extended, "--fit", str(file), "-o", str(tmp_path / f"at {name}")]) == 0
        )
    capsys.readouterr()
    assert run_command(["compare", str(tmp_path / "at before"), str(tmp_path / "at after")]) == 0
    assert "cogging:motor.amplitude fell by" in capsys.readouterr().out
