"""A system of two FMUs is diagnosed as a black box: recordings with windage, plant and controller apart."""

import json
import re
from pathlib import Path

import pytest

import thsa_cosim as tc

ROOT = Path(__file__).parents[2]
RECORDINGS = ROOT / "scenarios" / "recordings"
SYSTEM = f"""
[[components]]
name = "controller"
fmu = "{ROOT}/fmus/Controller.fmu"

[[components]]
name = "plant"
fmu = "{ROOT}/fmus/Plant.fmu"

[[connections]]
from = "controller.i_ref"
to = "plant.i_ref"

[[connections]]
from = "plant.w_m"
to = "controller.w_m"

[connectors]
v_cmd = "controller.v_cmd"
F_load = "plant.F_load"
T_amb = "plant.T_amb"
v = "plant.v"
x = "plant.x"
w_m = "plant.w_m"
i_q = "plant.i_q"
u_q = "plant.u_q"
"""
DIAGNOSE = """[diagnose]
command = "v_cmd"
load = "F_load"
spread = 0.1
effects = ["windage", "stribeck"]

[diagnose.blackbox]
speed = "v"
position = "x"
motor_speed = "w_m"
current = "i_q"
voltage = "u_q"

"""


def scenario() -> str:
    """The driven actuator's scenario, with the system in place of its FMU and of its Modelica package."""
    text = (ROOT / "scenarios" / "driven.toml").read_text(encoding="utf-8")
    text = text.replace('fmu = "../fmus/THSA.fmu"\n', "").replace('"recordings/', f'"{RECORDINGS}/')
    text = re.sub(r"\[diagnose\].*?(?=\[\[parameters\]\])", DIAGNOSE, text, flags=re.S)
    text = text.replace('"velocityController', '"controller.velocityController')
    text = re.sub(r'(variable|law_block) = "(?!controller)', r'\1 = "plant.', text)
    return text.replace("[recordings]", SYSTEM + "\n[recordings]", 1)


@pytest.mark.nightly
def test_a_missing_effect_is_found_around_a_system(tmp_path: Path) -> None:
    path = tmp_path / "system.toml"
    path.write_text(scenario(), encoding="utf-8")
    one = [RECORDINGS / "undeclared_fit_1.parquet"], [RECORDINGS / "undeclared_validate_1.parquet"]
    tc.diagnose(path, fit=one[0], validate=one[1], folder=tmp_path / "study", quiet=True)
    result = json.loads((tmp_path / "study" / "result.json").read_text())
    assert result["verdict"] == "missing-effect"
    assert [effect["name"] for effect in result["effects"]] == ["windage:motor"]
    before, after = (result[key]["validate"]["x"] for key in ("before", "after"))
    assert before["rmse"] > 2.0 * before["noise"]
    assert after["rmse"] < 1.1 * after["noise"]
