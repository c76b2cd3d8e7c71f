"""Margins of a loop with a sampled controller as requirements of a tuning: measured on the running system."""

import json
from pathlib import Path

import pytest

from thsa_cosim import cli
from thsa_cosim.errors import ScenarioError
from thsa_cosim.scenario import load

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(
    not (ROOT / "fmus" / "Controller.fmu").exists(), reason="fmus/Controller.fmu has not been exported"
)
LOOP = """[loop]
signal = "controller.w_m"
disturbance = "w_disturbance"
amplitude = 1.0

[[requirements]]
metric = "phase_margin"
minimum = 75.0

[[requirements]]
metric = "overshoot\""""


def scenario(folder: Path, loop: str = LOOP) -> Path:
    text = (ROOT / "scenarios" / "system_sampled.toml").read_text()
    text = text.replace('to = "controller.w_m"\n', 'to = "controller.w_m"\ndisturbance = "w_disturbance"\n')
    text = text.replace("../fmus", str(ROOT / "fmus"))
    text = text.replace('[[requirements]]\nmetric = "overshoot"', loop, 1)
    text = text.replace(
        "population = 16\ngenerations = 10", "population = 5\ngenerations = 1\npolish = false"
    )
    text = text.replace(
        "lower = 0.03\nupper = 3.0", "lower = 0.62\nupper = 0.7"
    )  # near gains that hold every limit
    text = text.replace("lower = 0.1\nupper = 30.0", "lower = 2.8\nupper = 3.0")
    path = folder / "sampled.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("line", "instead", "said"),
    [
        (
            'disturbance = "w_disturbance"\n',
            "",
            "is not linearised, its margins are measured: name a 'disturbance'",
        ),
        ("amplitude = 1.0\n", "", "loop.amplitude is missing"),
        ('"w_disturbance"', '"w_disturbanc"', "'w_disturbanc' is no input; .* Did you mean 'w_disturbance'"),
        (
            '"controller.w_m"',
            '"plant.w_m"',
            "loop.interval is missing: 'plant.w_m' is read by no sampled component",
        ),
    ],
)
def test_what_the_measurement_lacks_is_one_sentence(
    tmp_path: Path, line: str, instead: str, said: str
) -> None:
    with pytest.raises(ScenarioError, match=said):
        load(scenario(tmp_path, LOOP.replace(line, instead)))


@pytest.mark.slow
def test_delay_costs_margin_and_gains_that_fall_below_the_limit_are_marked(tmp_path: Path) -> None:
    """69.2 degrees at the gains that suit the continuous controller, as ``benchmarks/sampling.py`` measures."""
    study = tmp_path / "study"
    assert cli.run_command(["tune", str(scenario(tmp_path)), "-o", str(study), "--workers", "2"]) == 0
    result = json.loads((study / "result.json").read_text())
    continuous = result["compare"]["continuous"]
    assert continuous["phase_margin"] == pytest.approx(69.2, abs=0.3)
    assert result["before"]["phase_margin"] == pytest.approx(80.8, abs=0.3)
    assert not continuous["feasible"]
    assert result["after"]["phase_margin"] > 75.0
