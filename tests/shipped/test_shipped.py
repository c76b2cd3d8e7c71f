"""Shipped data: found in a checkout and in a wheel, copied as an example that runs."""

import tomllib
from pathlib import Path

import pytest

import thsa_cosim
from thsa_cosim import cli
from thsa_cosim import shipped as module
from thsa_cosim.errors import InputError
from thsa_cosim.shipped import copy_example, examples, modelica_package, shipped

ROOT = Path(__file__).parents[2]


def test_every_shipped_scenario_is_an_example_with_all_files_that_it_names() -> None:
    found = examples()
    assert set(found) == {path.stem for path in (ROOT / "scenarios").glob("*.toml")}
    motor = found["motor"]
    assert motor.kind == "identify"
    names = {str(path) for path in motor.needs}
    assert {"scenarios/motor.toml", "fmus/Motor.fmu", "scenarios/recordings/motor_m55.parquet"} <= names
    stages = {str(path) for path in found["actuator"].needs}
    assert motor.missing == ()
    assert found["emps"].missing == ("its recordings",)
    assert {"scenarios/screw.toml", "fmus/Screw.fmu", "scenarios/recordings/screw_p25.parquet"} <= stages


def test_an_example_runs_where_it_was_copied_to(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.run_command(["example", "gearbox", "-o", "mine"]) == 0
    assert "thsa-cosim identify mine/scenarios/gearbox.toml" in capsys.readouterr().out
    assert cli.run_command(["example", "screw", "-o", "mine"]) == 0  # files that are the same stay
    from thsa_cosim.scenario import load

    loaded = load(Path("mine/scenarios/gearbox.toml"))
    assert loaded.fmu.path.resolve() == (tmp_path / "mine/fmus/Gearbox.fmu").resolve()
    assert modelica_package(Path("mine")) == Path("mine/modelica/THSA")


def test_a_changed_file_is_never_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = copy_example("table4", tmp_path)[0]
    scenario.write_text(scenario.read_text() + "# mine\n")
    assert cli.run_command(["example", "table4", "-o", str(tmp_path)]) == 2
    assert "choose another folder" in capsys.readouterr().err
    assert scenario.read_text().endswith("# mine\n")


def test_without_a_name_examples_are_listed_and_a_misspelt_one_is_answered(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run_command(["example"]) == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in examples())
    assert cli.run_command(["example", "moter", "-o", str(tmp_path)]) == 2
    assert "Did you mean 'motor'?" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_wheel_is_preferred_and_an_incomplete_one_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_IN_WHEEL", tmp_path)
    (tmp_path / "fmus").mkdir()
    assert shipped("fmus") == tmp_path / "fmus"
    with pytest.raises(InputError, match="installation is incomplete"):
        shipped("scenarios")


def test_a_diagnosis_finds_the_package_beside_its_scenario_or_the_shipped_one(tmp_path: Path) -> None:
    from thsa_cosim.scenario import load

    text = (ROOT / "scenarios" / "driven.toml").read_text()
    text = text.replace('package = "../modelica/THSA"\n', "")
    assert "package" not in tomllib.loads(text)["diagnose"]
    beside = copy_example("driven", tmp_path / "whole")[0]
    beside.write_text(text)
    spec = load(beside).diagnose
    assert spec is not None
    assert spec.package.resolve() == (tmp_path / "whole/modelica/THSA").resolve()
    alone = tmp_path / "alone" / "scenarios"
    alone.mkdir(parents=True)
    text = text.replace("../fmus", str(ROOT / "fmus")).replace(
        '"recordings/', f'"{ROOT}/scenarios/recordings/'
    )
    (alone / "driven.toml").write_text(text)
    spec = load(alone / "driven.toml").diagnose
    assert spec is not None
    assert spec.package == shipped("modelica", "THSA")


def test_one_version_everywhere() -> None:
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert thsa_cosim.__version__ == stated
    assert f"\nversion: {stated}\n" in (ROOT / "CITATION.cff").read_text()
