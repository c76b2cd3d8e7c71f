"""Texts in ``[fixed]``: they reach the FMU in every kind of run, and what does not fit is one sentence."""

import json
from pathlib import Path

import numpy as np
import pytest
from fmu_sources.build import texts

from thsa_cosim.cli import run_command
from thsa_cosim.errors import ScenarioError
from thsa_cosim.scenario import load
from thsa_cosim.simulate import simulate
from thsa_cosim.study.identity import study_identity
from thsa_cosim.study.place import Place

SCENARIO = """
kind = "{kind}"
fmu = "texts.fmu"

[recordings]
fit = ["data.csv"]
[recordings.time]
column = "t"
unit = "s"
[recordings.columns.u]
column = "u"
[recordings.columns.y]
column = "y"
{columns}
[fixed]
{fixed}
"""
GAIN = """
[[parameters]]
name = "gain"
variable = "gain"
unit = "1"
lower = 0.1
upper = 10.0
[cost.channels.y]
noise = 0.01
"""


def scenario(
    folder: Path, fixed: str, version: str = "2", kind: str = "simulate", columns: str = "", more: str = ""
) -> Path:
    (folder / "texts.fmu").write_bytes(texts(version).read_bytes())
    time = np.arange(101) * 0.01
    u = np.sin(3.0 * time)
    noise = np.random.default_rng(1).normal(0.0, 0.01, 101)
    rows = zip(time, u, 21.0 * u + noise, strict=True)
    lines = ["t,u,y", *(f"{t:.2f},{a:.6f},{b:.6f}" for t, a, b in rows)]
    (folder / "data.csv").write_text("\n".join(lines) + "\n")
    (folder / "own curve.txt").write_text("3.5")
    path = folder / "texts.toml"
    path.write_text(SCENARIO.format(kind=kind, fixed=fixed, columns=columns) + more, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("version", "fixed", "factor"),
    [
        ("1", 'curve = "steep"', 5.0),
        ("2", 'curve = "steep"', 7.0),
        ("3", 'curve = "steep"\nmode = "twice"', 14.0),
        ("2", 'curve = { file = "own curve.txt" }', 3.5),
    ],
)
def test_a_scenario_gives_texts_to_parameters_and_inputs(
    tmp_path: Path, version: str, fixed: str, factor: float
) -> None:
    result = simulate(load(scenario(tmp_path, fixed, version)), Place(tmp_path / "study"))
    (run,) = result.recordings
    assert run.simulated is not None, run.reason
    data = np.loadtxt(tmp_path / "data.csv", delimiter=",", skiprows=1)
    assert run.simulated["y"] == pytest.approx(factor * data[:, 1], rel=1e-12)


def test_an_identification_has_the_texts_in_every_run(tmp_path: Path) -> None:
    """y = 21 u is gain 3 with the steep curve, which has 7; with the flat one the bound 10 would not do."""
    path = scenario(tmp_path, 'curve = "steep"', kind="identify", more=GAIN)
    assert run_command(["identify", str(path), "-o", str(tmp_path / "study"), "--workers", "1"]) == 0
    result = json.loads((tmp_path / "study" / "result.json").read_text())
    assert result["points"][0]["parameters"]["gain"]["value"] == pytest.approx(3.0, abs=0.01)


@pytest.mark.parametrize(
    ("fixed", "columns", "sentence"),
    [
        ("curve = 3.0", "", "fixed.curve: 'curve' of texts.fmu is a text; give it in quotes, not 3.0."),
        (
            'gain = "steep"',
            "",
            "fixed.gain: must be a number, not 'steep'; 'gain' of texts.fmu is of type Real.",
        ),
        ('curve = { file = "own curv.txt" }', "", "fixed.curve.file: there is no file"),
        ('curve = "a\\u0000b"', "", "fixed.curve: the text holds a null character; remove it."),
        ('gain = { file = "own curve.txt" }', "", "fixed.gain: must be a number"),
        (
            "",
            '[recordings.columns.mode]\ncolumn = "u"\n',
            "recordings.columns.mode is a text of texts.fmu, not a signal; give it in [fixed].",
        ),
    ],
)
def test_what_does_not_fit_is_one_sentence(tmp_path: Path, fixed: str, columns: str, sentence: str) -> None:
    with pytest.raises(ScenarioError) as error:
        load(scenario(tmp_path, fixed, columns=columns))
    assert sentence in str(error.value)


def test_a_text_is_not_searched(tmp_path: Path) -> None:
    more = GAIN.replace('variable = "gain"', 'variable = "curve"')
    with pytest.raises(ScenarioError, match="'curve' is a String; only real numbers are searched"):
        load(scenario(tmp_path, "", kind="identify", more=more))


def test_a_text_and_a_files_content_make_another_study(tmp_path: Path) -> None:
    flat = study_identity(load(scenario(tmp_path, 'curve = "flat"')))
    steep = study_identity(load(scenario(tmp_path, 'curve = "steep"')))
    assert {key for key in flat if flat[key] != steep.get(key)} == {"fixed.curve"}
    path = scenario(tmp_path, 'curve = { file = "own curve.txt" }')
    before = study_identity(load(path))
    (tmp_path / "own curve.txt").write_text("4.5")
    after = study_identity(load(path))
    assert {key for key in before if before[key] != after.get(key)} == {"fixed.curve.file"}


def test_check_takes_a_text(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fmu = str(texts("2"))
    assert run_command(["check", fmu, "--start", "curve=no such = curve", "--duration", "0.1"]) == 3
    assert "EnterInitializationMode" in capsys.readouterr().out
    assert (
        run_command(["check", fmu, "--start", "curve=steep", "--start", "gain=2", "--duration", "0.1"]) == 0
    )
