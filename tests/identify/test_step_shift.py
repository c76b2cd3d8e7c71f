"""What the communication step of a foreign FMU moves identified values by is said, and held by their errors."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmu_sources import build

from identify.lag import TAU, lag_scenario
from thsa_cosim import cli

NOISE = 0.01
GAIN = """
[[parameters]]
name = "gain"
variable = "gain"
lower = 0.2
upper = 5.0
unit = "1"
"""


def identified(fmu: Path, folder: Path) -> dict[str, Any]:
    """``result.json`` of the exact answer of a lag, with noise, that ``fmu`` is fitted to."""
    scenario = lag_scenario(folder, fmu, noise=NOISE, further=GAIN)
    assert cli.run_command(["identify", str(scenario), "-o", str(folder / "out")]) == 0
    found: dict[str, Any] = json.loads((folder / "out" / "result.json").read_text())
    return found


def test_a_value_that_the_step_moves_is_not_trusted_and_its_error_holds_the_truth(tmp_path: Path) -> None:
    """One explicit Euler step of 5 ms: the change of the signals is an eighth of the noise, and moves the gain."""
    result = identified(build.habits2("EULER"), tmp_path)
    found, shifts = result["points"][0]["parameters"], result["coupling"]["shifts_in_standard_errors"]
    assert result["coupling"]["halved"]["y"]["rms"] < 0.2 * NOISE  # the signals alone would not tell
    for name, true in (("tau", TAU), ("gain", 1.0)):
        value, stderr = found[name]["value"], found[name]["stderr"]
        plain = stderr / np.hypot(1.0, shifts[name])
        assert value + shifts[name] * plain == pytest.approx(true, abs=2.5 * plain)
        assert abs(value - true) < 2.0 * stderr
    gain = found["gain"]["stderr"] / np.hypot(1.0, shifts["gain"])
    assert abs(found["gain"]["value"] - 1.0) > 2.5 * gain
    assert result["trust"]["verdict"] == "not-explained"
    (reason,) = result["trust"]["reasons"]
    assert f"without steps it would move gain by {shifts['gain']:+.2g} standard errors" in reason
    assert reason.endswith("lower simulation.step")


def test_a_step_that_moves_nothing_widens_nothing(tmp_path: Path) -> None:
    result = identified(build.habits2(), tmp_path)
    assert all(abs(s) < 1.0 for s in result["coupling"]["shifts_in_standard_errors"].values())
    assert result["trust"] == {"verdict": "explained", "reasons": []}
    tau = result["points"][0]["parameters"]["tau"]
    assert abs(tau["value"] - TAU) < 3.0 * tau["stderr"] < 0.004
