"""``thsa-cosim diagnose``: from shipped recordings to a better model, and refusals."""

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from thsa_cosim import cli
from thsa_cosim.api.conduct import ask
from thsa_cosim.cli.options import StudyOptions
from thsa_cosim.export import export_fmu
from thsa_cosim.fmu import Plant
from thsa_cosim.scenario import Scenario, load
from thsa_cosim.study import claim_folder, study_identity

ROOT = Path(__file__).parents[2]
DRIVEN = ROOT / "scenarios" / "driven.toml"
RECORDINGS = ROOT / "scenarios" / "recordings"


def scenario(folder: Path, rows: int | None = None, **replacements: str) -> Path:
    """The shipped scenario with one recording to fit and one to judge, the first ``rows`` of each."""
    for part in ("fit", "validate"):
        table = pd.read_parquet(RECORDINGS / f"undeclared_{part}_1.parquet")
        table.head(rows or len(table)).to_parquet(folder / f"{part}.parquet")
    text = DRIVEN.read_text(encoding="utf-8")
    changes = {
        '"../fmus/THSA.fmu"': json.dumps(str(ROOT / "fmus" / "THSA.fmu")),
        '"../modelica/THSA"': json.dumps(str(ROOT / "modelica" / "THSA")),
        "recordings/undeclared_fit_*": "fit",
        "recordings/undeclared_validate_*": "validate",
        **replacements,
    }
    for old, new in changes.items():
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "small.toml"
    path.write_text(text, encoding="utf-8")
    return path


MISTAKES = {
    "effect": (
        "[diagnose]\n",
        '[diagnose]\neffects = ["windige"]\n',
        "no effect 'windige'. Did you mean 'windage'?",
    ),
    "key": ("[diagnose]\n", "[diagnose]\nmots = 2\n", "Did you mean 'most'?"),
    "command": (
        'command = "v_cmd"',
        'command = "v_cnd"',
        "'v_cnd' is no input with a column. Did you mean 'v_cmd'?",
    ),
    "formula": ('"der(i_q)"', '"der(i_qm)"', "'i_qm' in 'der(i_qm)' has no column. Did you mean 'i_q'?"),
    "moving": (
        'moving = ["w_m"',
        'moving = ["w_n"',
        "diagnose.balances[mechanical].moving: 'w_n' has no column.",
    ),
    "model": ('model = "THSA.Actuator"', 'model = "THSA.Aktuator"', "Aktuator"),
    "slots": ('model = "THSA.Actuator"', 'model = "THSA.Benches.Motor"', "has no effect slot"),
    "held-out": ('["validate.parquet"]', "[]", "recordings.validate names no recording"),
}


@pytest.mark.parametrize(("old", "new", "says"), MISTAKES.values(), ids=MISTAKES)
def test_bad_input_is_one_sentence_and_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, says: str
):
    path = scenario(tmp_path, 2000, **{old: new})
    assert cli.run_command(["diagnose", str(path), "-o", str(tmp_path / "study")]) == 2
    captured = capsys.readouterr()
    sentences = [line for line in captured.err.splitlines() if not line.startswith(" ")]  # indented: progress
    assert len(sentences) == 1
    assert says in sentences[0]
    assert captured.out == ""


CHANGED = {
    "effects": ('effects = ["windage", "stribeck"]', 'effects = ["stribeck"]', "diagnose.effects"),
    "most": ("most = 2", "most = 1", "diagnose.most = 2; this one has diagnose.most = 1"),
    "spread": ("spread = 0.05", "spread = 0.2", "diagnose.spread = 0.05; this one has diagnose.spread = 0.2"),
    "empirical": ("empirical = true", "empirical = false", "diagnose.empirical = true"),
}


@pytest.mark.parametrize(("old", "new", "says"), CHANGED.values(), ids=CHANGED)
def test_a_finished_folder_does_not_answer_another_question(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, says: str
):
    asked = '[diagnose]\neffects = ["windage", "stribeck"]\nmost = 2\nspread = 0.05\nempirical = true\n'
    study = tmp_path / "study"
    first = scenario(tmp_path, 2000, **{"[diagnose]\n": asked, "spread = 0.1": ""})
    claim_folder(study, study_identity(load(first)))
    (study / "result.json").write_text('{"kind": "diagnose", "status": "complete"}', encoding="utf-8")
    first.write_text(first.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    assert cli.run_command(["diagnose", str(first), "-o", str(study)]) == 2
    assert says in capsys.readouterr().err


def test_the_package_of_the_command_line_takes_the_place_of_the_scenarios(tmp_path: Path):
    path = scenario(tmp_path, 2000)
    own, other = ask("diagnose", path).scenario, ask("diagnose", path, package=tmp_path).scenario
    assert isinstance(own, Scenario)
    assert isinstance(other, Scenario)
    assert other.diagnose is not None
    assert other.diagnose.package == tmp_path
    assert other.diagnose.model == "THSA.Actuator"
    changed = {k for k, v in study_identity(other).items() if study_identity(own)[k] != v}
    assert changed == {"diagnose.package"}


def test_one_that_is_interrupted_says_that_there_is_no_result_yet_and_how_to_continue(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    def pressed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("thsa_cosim.diagnosis.run.open_superset", pressed)
    path, study = scenario(tmp_path, 2000), tmp_path / "study"
    assert cli.run_command(["diagnose", str(path), "-o", str(study)]) == 130
    assert capsys.readouterr().err.splitlines()[-1] == (
        f"interrupted before there was a result ({study} holds no result.json); finished runs are kept, continue with:"
        f" thsa-cosim diagnose {path} -o {study}"
    )


def diagnosed(path: Path, study: Path) -> tuple[dict[str, Any], str]:
    """The result of the command in a process of its own, and what it printed."""
    done = subprocess.run(
        [sys.executable, "-m", "thsa_cosim.cli", "diagnose", str(path), "-o", str(study), "--workers", "2"],
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert done.returncode == 0, done.stderr
    return json.loads((study / "result.json").read_text(encoding="utf-8")), done.stdout


@pytest.mark.slow
def test_it_finds_the_effect_and_writes_a_model_that_predicts_to_the_noise(tmp_path: Path):
    chosen = '[diagnose]\neffects = ["windage", "stribeck", "current-sensor-gain", "friction-run-in"]\n'
    path, study = scenario(tmp_path, **{"[diagnose]\n": chosen}), tmp_path / "study"
    result, _ = diagnosed(path, study)
    assert result["verdict"] == "missing-effect"
    assert [e["name"] for e in result["effects"]] == ["windage:motor"]
    assert {b["equation"]: b["at_fault"] for b in result["balance"]} == {
        "electrical": False,
        "mechanical": True,
        "power": result["balance"][2]["at_fault"],
        "kinematic: speed": False,
        "kinematic: position": False,
    }
    before, after = result["before"]["validate"], result["after"]["validate"]
    assert before["i_q"]["rmse"] > 1.1 * before["i_q"]["noise"]
    for channel, error in after.items():
        assert error["rmse"] < 1.05 * error["noise"], channel
    assert not any("standard errors are those" in note for note in result["notes"])

    # The class alone gives the model again, with the values that were found.
    again = export_fmu(
        str(study / result["model"]), package=ROOT / "modelica" / "THSA", output=tmp_path / "again.fmu"
    )
    time, runs = np.linspace(0.0, 0.5, 251), []
    for fmu in (study / result["fmu"], again):
        with Plant.open(fmu) as plant:
            runs.append(plant.run({"v_cmd": 6e-3, "F_load": 2e4, "T_amb": -30.0}, None, ("v", "i_q"), time))
    np.testing.assert_array_equal(runs[0]["i_q"], runs[1]["i_q"])
    value = result["effects"][0]["parameters"]["b_q"]
    found = json.dumps(value["value"])[:4]
    assert f'b_q(unit="{value["unit"]}") = {found}' in (study / result["model"]).read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_law_that_no_effect_explains_is_told_with_what_ties_with_it(tmp_path: Path):
    chosen = '[diagnose]\neffects = ["current-sensor-gain"]\nempirical = true\n'
    path, study = scenario(tmp_path, **{"[diagnose]\n": chosen}), tmp_path / "study"
    result, shown = diagnosed(path, study)
    assert result["effects"] == []
    (law,) = result["empirical"]["terms"]
    ((rival,),) = (other["terms"] for other in result["instead"])
    assert {law["slot"], rival["slot"]} == {"motor", "gearbox"}, "a rigid gear"
    assert law["term"] == rival["term"] == "v |v|"
    assert "could not distinguish this law from another" in " ".join(shown.split())
    assert "in place of the law above" in (study / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(("verdict", "code"), [("not-tested", 3), ("missing-effect", 0)])
def test_a_study_in_which_no_effect_could_be_tried_leaves_with_3(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verdict: str, code: int
):
    done = SimpleNamespace(open=lambda: SimpleNamespace(result={"verdict": verdict}))
    concluded: list[object] = []
    monkeypatch.setattr(StudyOptions, "ask", lambda *given: None)
    monkeypatch.setattr(StudyOptions, "conduct", lambda *given: done)
    monkeypatch.setattr(StudyOptions, "conclude", lambda self, what: concluded.append(what))
    assert cli.run_command(["diagnose", str(DRIVEN), "-o", str(tmp_path / "study")]) == code
    assert concluded == [done], "the result is shown all the same"


def test_a_further_recording_is_fitted_in_addition_to_the_scenarios_or_the_given_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    asked: list[tuple[Path, ...]] = []
    done = SimpleNamespace(open=lambda: SimpleNamespace(result={"verdict": "missing-effect"}))
    monkeypatch.setattr(StudyOptions, "ask", lambda self, *given: asked.append(self.fit))
    monkeypatch.setattr(StudyOptions, "conduct", lambda *given: done)
    monkeypatch.setattr(StudyOptions, "conclude", lambda *given: None)
    for more in ([], ["--with", "new.csv"], ["--fit", "a.csv", "--with", "new.csv", "--with", "b.csv"]):
        assert cli.run_command(["diagnose", str(DRIVEN), *more]) == 0
    own = sorted((DRIVEN.parent / "recordings").glob("undeclared_fit_*.parquet"))
    assert own
    names = [[path.name for path in fit] for fit in asked]
    assert names == [[], [*(p.name for p in own), "new.csv"], ["a.csv", "new.csv", "b.csv"]]
