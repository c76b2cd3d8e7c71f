"""Gains of a vendor's Co-Simulation drive: what they owe to its communication step."""

import json
from pathlib import Path

import pytest
from fmu_sources.build import drive2

from thsa_cosim.cli import run_command

SCENARIO = """
kind = "tune"
fmu = "{fmu}"

[command]
input = "w_cmd"
output = "w"
unit = "rad/s"
shape = "ramp"
final = 10.0
rate = 100.0
begin = 0.1
stop = 1.0
step = {step}

[conditions.tau_load]
values = [0.1]
unit = "N.m"

[[parameters]]
name = "K_p"
variable = "K_p"
unit = "A.s/rad"
lower = 0.5
upper = 1.5

[[parameters]]
name = "K_i"
variable = "K_i"
unit = "A/rad"
lower = 5.0
upper = 20.0

[before]
K_p = 1.0
K_i = 10.0

[metrics]
rise = "first-reach"
fraction = 0.95
window = [0.8, 1.0]
settling_band = 0.02

[cost]
unit = "rad/s"
kappa_rise = 10.0
kappa_steady = 10.0

[search]
population = 5
generations = 2
polish = false
"""


@pytest.mark.slow
@pytest.mark.parametrize(("defines", "step", "warned"), [(("EULER",), 0.02, True), ((), 0.002, False)])
def test_what_half_the_step_changes_is_said_with_figures(
    tmp_path: Path, defines: tuple[str, ...], step: float, warned: bool
) -> None:
    path = tmp_path / "vendor.toml"
    path.write_text(SCENARIO.format(fmu=drive2(*defines), step=step))
    assert run_command(["tune", str(path), "-o", str(tmp_path / "study"), "--workers", "1"]) == 0
    result = json.loads((tmp_path / "study" / "result.json").read_text())
    change = result["coupling"]["halved"]["w"]
    assert change["unit"] == "rad/s"
    assert change["range"] == pytest.approx(10.0, rel=0.3)
    assert (change["rms"] > 0.01 * change["range"]) is warned
    (note,) = [n for n in result["notes"] if "halving the communication steps" in n]
    assert note.startswith("WARNING") is warned
    assert result["trust"]["verdict"] == ("not-explained" if warned else "explained")
    if warned:
        assert "% of its range" in note
        assert note.endswith("lower command.step")
