"""Identification with an FMU of another tool: what it does with inputs and start values is found out first."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from fmu_sources import build

from identify.lag import TAU, lag_scenario

FURTHER = """
[[parameters]]
name = "at"
variable = "at"
lower = 0.2
upper = 0.8
unit = "s"

[search]
population = 8
generations = 12
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """The study's folder, and the lines that the command wrote to the terminal while it ran."""
    folder = tmp_path_factory.mktemp("foreign")
    fmu = build.lag2("WRONG_SLOPE", "RESET_IN_SETUP", tool="vendor")
    scenario = lag_scenario(folder, fmu, noise=1e-3, further=FURTHER)
    command = [
        sys.executable,
        "-m",
        "thsa_cosim",
        "identify",
        str(scenario),
        "-o",
        str(folder / "out"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "out", done.stderr.splitlines()


@pytest.fixture(scope="module")
def result(study: tuple[Path, list[str]]) -> dict[str, object]:
    found: dict[str, object] = json.loads((study[0] / "result.json").read_text())
    return found


def test_values_are_right_within_their_stated_errors(result: dict[str, object]) -> None:
    tau = result["points"][0]["parameters"]["tau"]  # type: ignore[index]
    assert tau["identifiable"]
    assert abs(tau["value"] - TAU) < 3.0 * tau["stderr"]
    assert tau["stderr"] < 1e-3


def test_the_parameter_that_does_nothing_is_named(result: dict[str, object]) -> None:
    notes = result["notes"]
    assert any(note.startswith("at changes no output of the FMU in any recording") for note in notes)  # type: ignore[attr-defined]
    assert not any(note.startswith("tau") for note in notes)  # type: ignore[attr-defined]


def test_it_is_named_on_the_terminal_before_the_search(study: tuple[Path, list[str]]) -> None:
    _, lines = study
    (named,) = [k for k, line in enumerate(lines) if line.startswith("at changes no output of the FMU")]
    assert "remove it from [[parameters]]" in lines[named]
    searching = [k for k, line in enumerate(lines) if "searching" in line]
    assert searching, lines
    assert named < min(searching)


def test_the_inputs_are_given_in_the_way_that_the_trial_found(result: dict[str, object]) -> None:
    (note,) = [note for note in result["notes"] if note.startswith("Inputs:")]  # type: ignore[attr-defined]
    assert note.startswith(
        "Inputs: held at the mean of a step (largest error over range against Model Exchange"
    )
    assert "WARNING" not in note
