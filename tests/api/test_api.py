"""``import thsa_cosim as tc``: studies as tables and figures, run here or opened from their folder."""

import errno
import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from small_scenario import toml

import thsa_cosim as tc
from thsa_cosim.errors import InputError, MachineError, ScenarioError
from thsa_cosim.report.signal_files import write_signals
from thsa_cosim.signals import Signals

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"
pytestmark = pytest.mark.skipif(
    not (ROOT / "fmus" / "Screw.fmu").exists(), reason="fmus/Screw.fmu has not been exported"
)


def shortened(name: str, folder: Path, **replacements: str) -> Path:
    """A shipped scenario with a small search, its paths made absolute."""
    text = (SCENARIOS / name).read_text()
    changes = {
        '"../fmus/': f'"{ROOT / "fmus"}/',
        "population = 45": "population = 8",
        "generations = 30": "generations = 4",
        **replacements,
    }
    for old, new in changes.items():
        assert old in text, old
        text = text.replace(old, new)
    path = folder / name
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> tc.IdentifyStudy:
    folder = tmp_path_factory.mktemp("api")
    recordings = ", ".join(
        f'"{SCENARIOS}/recordings/screw_{t}.parquet"' for t in ("m55", "m30", "p00", "p25")
    )
    scenario = shortened("screw.toml", folder, **{'"recordings/screw_*.parquet"': recordings})
    return tc.identify(scenario, folder=folder / "study", workers=2, quiet=True)


def test_parameters_are_a_table_over_points_and_names(identified: tc.IdentifyStudy) -> None:
    table = identified.parameters
    assert list(table.index.names) == ["point", "parameter"]
    found = table.loc[(-30.0, "F_fn")]
    assert found["unit"] == "N"
    assert found["value"] == pytest.approx(
        2.7e3 - 37 * 30 - 1.4 * 900 + 0.07 * 27000, abs=5 * found["stderr"]
    )
    wide = table["value"].unstack()
    assert wide.index.tolist() == [-55.0, -30.0, 0.0, 25.0]
    assert table["identifiable"].all()


def test_laws_are_a_table_and_functions(identified: tc.IdentifyStudy) -> None:
    assert identified.laws.loc["b_n", "form"] == "quadratic"
    assert identified.laws.loc["b_n", "published"] == (4e4, -3e3, 230.0)
    assert float(identified.law("b_n")(-40.0)) == pytest.approx(4e4 + 3e3 * 40 + 230.0 * 1600, rel=0.02)
    with pytest.raises(InputError, match=r"'F_n' has no law\. Did you mean 'F_fn'\?"):
        identified.law("F_n")


def test_recordings_and_signals_agree(identified: tc.IdentifyStudy) -> None:
    row = identified.recordings.loc[("fit", "screw_m30", "F")]
    signals = identified.signals("screw_m30")["F [N]"]
    rmse = float(np.sqrt(np.mean((signals["simulated"] - signals["measured"]) ** 2)))
    assert row["rmse"] == pytest.approx(rmse, rel=1e-6)
    assert 0.8 < row["rmse / noise"] < 1.2
    assert signals.index.name == "time [s]"
    with pytest.raises(InputError, match=r"no recording 'screw_m31'\. Did you mean 'screw_m30'\?"):
        identified.signals("screw_m31")


def test_journal_and_failures(identified: tc.IdentifyStudy) -> None:
    # Every vector that was simulated, except those that were known: of each point the best is asked for again.
    evaluations = sum(point["evaluations"] for point in identified.result["points"])
    assert 0.9 * evaluations <= len(identified.journal) <= evaluations
    assert {"F_fn", "b_n", "cost"} <= set(identified.journal.columns)
    assert identified.failures.sum() == 0


def test_every_plot_draws_and_names_its_units(identified: tc.IdentifyStudy) -> None:
    assert identified.plots[:4] == ("laws", "F_fn", "b_n", "convergence")
    for name in ("laws", "b_n", "convergence", "screw_m55"):
        figure = identified.plot(name)
        assert isinstance(figure, Figure)
        assert all(axes.lines for axes in figure.axes)
        # Panels beside each other share the label of the left one.
        left = min(axes.get_position().x0 for axes in figure.axes)
        labels = [axes.get_ylabel() for axes in figure.axes if axes.get_position().x0 < left + 0.01]
        assert labels
        assert all("[" in label for label in labels)
    assert identified.plot()._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(InputError, match=r"no plot 'convergense'\. Did you mean 'convergence'\?"):
        identified.plot("convergense")


def test_a_study_opens_as_it_was(identified: tc.IdentifyStudy) -> None:
    again = tc.open_study(identified.folder)
    assert isinstance(again, tc.IdentifyStudy)
    pd.testing.assert_frame_equal(again.parameters, identified.parameters)
    assert "complete" in repr(again)


def test_tune_gives_gains_and_terms(tmp_path: Path) -> None:
    scenario = shortened("table4.toml", tmp_path, **{"points = 25": "points = 3"})
    study = tc.tune(scenario, folder=tmp_path / "study", workers=2, quiet=True)
    assert study.feasible == bool(study.result["after"]["feasible"])
    assert study.parameters.loc["K_p", "before"] == 0.12
    assert study.terms.loc["rise_time", "before"] == pytest.approx(0.44, abs=0.01)
    assert study.terms.loc["rise_time", "unit"] == "s"
    assert study.schedule[["temperature_degC", "F_load_kN"]].to_numpy().tolist() == [[-30.0, 55.0]]
    response = study.signals("T_amb = -30 degC, F_load = 55 kN")["v [mm/s]"]
    assert response["command"].iloc[-1] == pytest.approx(9.0)
    assert study.plots[-1] == "convergence"
    assert all(axes.lines for axes in study.plot().axes)


def test_simulate_compares(tmp_path: Path) -> None:
    recording = SCENARIOS / "recordings" / "driven_p25_b.parquet"
    study = tc.simulate(
        SCENARIOS / "driven_check.toml", validate=[recording], folder=tmp_path / "study", workers=1
    )
    assert isinstance(study, tc.SimulateStudy)
    assert (study.recordings["rmse / noise"] < 1.1).all()
    assert study.plots == ("driven_p25_b",)


def test_a_scenario_may_be_a_dict(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its paths are relative to where one is; paths, tuples and arrays may stand in it."""
    monkeypatch.chdir(tmp_path)
    scenario = {
        "title": "Screw at 25 degC",
        "fmu": ROOT / "fmus" / "Screw.fmu",
        "recordings": tomllib.loads((SCENARIOS / "screw.toml").read_text())["recordings"]
        | {"fit": (SCENARIOS / "recordings" / "screw_p25.parquet",)},
    }
    study = tc.simulate(scenario, workers=1, quiet=True)
    assert study.title == "Screw at 25 degC"
    assert study.folder.parent == Path("studies")
    assert study.folder.name.startswith("screw-at-25-degc")
    file = tmp_path / "screw.toml"
    scenario |= {"kind": "simulate", "fmu": str(scenario["fmu"])}
    scenario["recordings"] |= {"fit": [str(name) for name in scenario["recordings"]["fit"]]}
    file.write_text(toml(scenario))
    pd.testing.assert_frame_equal(tc.simulate(file, workers=1, quiet=True).recordings, study.recordings)
    with pytest.raises(ScenarioError, match=r"^scenario: unknown key 'titel'"):
        tc.simulate({**scenario, "titel": "x"})


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"seed": "a"}, "seed must be a whole number from 0 on, not 'a'."),
        ({"seed": -1}, "seed must be a whole number from 0 on, not -1."),
        ({"workers": 0}, "workers must be a whole number from 1 on, not 0."),
        ({"workers": 1.5}, "workers must be a whole number from 1 on, not 1.5."),
    ],
)
def test_numbers_that_are_none_claim_no_folder(
    tmp_path: Path, arguments: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(InputError) as raised:
        tc.identify(SCENARIOS / "screw.toml", folder=tmp_path / "study", **arguments)
    assert str(raised.value) == sentence
    assert not (tmp_path / "study").exists()


def test_what_is_no_scenario_is_one_sentence() -> None:
    for source in (None, 42):
        with pytest.raises(ScenarioError, match="path of a TOML file, or its content as a dict, not"):
            tc.identify(source)  # type: ignore[arg-type]


def test_one_recording_needs_no_list(tmp_path: Path) -> None:
    one = str(SCENARIOS / "recordings" / "screw_p25.parquet")
    study = tc.simulate(SCENARIOS / "screw.toml", fit=one, folder=tmp_path, workers=np.int64(1), quiet=True)
    assert study.recordings.index.get_level_values("recording").unique().tolist() == ["screw_p25"]


def test_a_full_disk_names_the_folder_and_the_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("thsa_cosim.report.simulate.files.write_signals", refuse)
    with pytest.raises(
        MachineError, match=r"folder .*study cannot be written \(No space.*same command again\.$"
    ):
        tc.simulate(
            SCENARIOS / "screw.toml",
            fit=SCENARIOS / "recordings" / "screw_p25.parquet",
            folder=tmp_path / "study",
            workers=1,
            quiet=True,
        )


def test_a_law_that_is_missing_says_why(tmp_path: Path) -> None:
    why = "T_fg has no quadratic law: that needs 3 temperatures, there are 2."
    (tmp_path / "result.json").write_text(json.dumps({"kind": "identify", "laws": {}, "notes": [why]}))
    study = tc.open_study(tmp_path)
    assert isinstance(study, tc.IdentifyStudy)
    with pytest.raises(InputError, match=f"'T_fg' has no law. {why}"):
        study.law("T_fg")


def test_a_scenario_of_another_kind_names_the_right_one(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="of kind 'tune': run 'thsa-cosim tune "):
        tc.identify(SCENARIOS / "table4.toml")
    recording = f'"{SCENARIOS}/recordings/driven_p25_b.parquet"'
    text = (SCENARIOS / "driven_check.toml").read_text()
    path = tmp_path / "check.toml"
    path.write_text(
        text.replace('"../fmus/', f'"{ROOT / "fmus"}/').replace('"recordings/driven_*.parquet"', recording)
    )
    with pytest.raises(ScenarioError, match=r"of kind .simulate.: run .thsa-cosim simulate "):
        tc.identify(path)


def test_a_folder_without_a_result_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no result of a study"):
        tc.open_study(tmp_path)
    (tmp_path / "result.json").write_text("[]")
    with pytest.raises(InputError, match="is no result of this version"):
        tc.open_study(tmp_path)


def test_a_diagnosis_tells_effects_and_held_out_errors(tmp_path: Path) -> None:
    errors = {"v": {"rmse": 3e-5, "noise": 2e-5}}
    found = {
        "kind": "diagnose",
        "status": "complete",
        "verdict": "no-missing-effect",
        "effects": [],
        "before": {"fit": {}, "validate": errors},
        "after": {"fit": {}, "validate": {}},
    }
    (tmp_path / "result.json").write_text(json.dumps(found))
    study = tc.open_study(tmp_path)
    assert isinstance(study, tc.DiagnoseStudy)
    assert study.effects.empty
    assert list(study.effects.columns) == ["value", "stderr", "unit", "identifiable", "probability"]
    assert study.held_out.loc["v", "before"] == 3e-5

    value = {"value": 6e-6, "stderr": 1e-8, "unit": "N.m.s2/rad2", "identifiable": False}
    effect = {"name": "windage:motor", "probability": 0.99, "parameters": {"b_q": value}}
    found |= {"effects": [effect], "after": {"fit": {}, "validate": {"v": {"rmse": 2e-5, "noise": 2e-5}}}}
    (tmp_path / "result.json").write_text(json.dumps(found))
    study = tc.open_study(tmp_path)
    assert isinstance(study, tc.DiagnoseStudy)
    assert study.effects.loc[("windage:motor", "b_q"), "value"] == 6e-6
    assert not study.effects.loc[("windage:motor", "b_q"), "identifiable"]
    assert study.held_out.loc["v", "after"] == 2e-5


def test_recordings_of_a_diagnosis_are_those_of_its_last_model(tmp_path: Path) -> None:
    """Two recordings of one name are told apart by their role."""
    error = {"rmse": 4e-5, "noise": 2e-5}
    before = {"fit/ramp": {"v": error}, "validate/ramp": {"v": error | {"rmse": 6e-5}}}
    found = {
        "kind": "diagnose",
        "status": "complete",
        "before": {"recordings": before},
        "after": {"recordings": {}},
    }
    measured = Signals(np.arange(3) * 0.1, {"v": np.array([0.0, 4e-3, -4e-3])}, {"v": "m/s"})
    for role in ("fit", "validate"):
        write_signals(tmp_path, role, "ramp", {"measured": measured, "before": measured})
    (tmp_path / "result.json").write_text(json.dumps(found))
    row = tc.open_study(tmp_path).recordings.loc[("validate", "ramp", "v")]
    assert dict(row) == {"rmse": 6e-5, "noise": 2e-5, "rmse / noise": 3.0, "nrmse": 0.0075, "unit": "m/s"}
    found["after"] = {"recordings": before | {"fit/ramp": {"v": error | {"rmse": 2e-5}}}}
    (tmp_path / "result.json").write_text(json.dumps(found))
    assert tc.open_study(tmp_path).recordings.loc[("fit", "ramp", "v"), "rmse / noise"] == 1.0


def test_names_of_the_package() -> None:
    assert sorted(tc.__all__) == [
        "DiagnoseStudy",
        "IdentifyStudy",
        "SimulateStudy",
        "Study",
        "TuneStudy",
        "__version__",
        "compare",
        "diagnose",
        "identify",
        "init",
        "list_studies",
        "open_study",
        "sensitivity",
        "simulate",
        "tune",
    ]
    assert all(getattr(tc, name) for name in tc.__all__)


def test_functions_stay_functions_when_their_modules_are_imported() -> None:
    from thsa_cosim.identify import Estimate

    assert sys.modules["thsa_cosim.identify"].Estimate is Estimate
    assert tc.identify.__module__ == "thsa_cosim.api.run"


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = (
        "import sys, thsa_cosim; heavy = {'numpy', 'pandas', 'matplotlib', 'scipy', 'pydantic', 'rich'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
