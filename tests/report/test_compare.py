"""Studies of a folder in a list, and what differs between some of them."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
import report_studies as studies

import thsa_cosim as tc
from thsa_cosim import cli
from thsa_cosim.errors import InputError
from thsa_cosim.report.compare import compare, list_studies


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one study of every kind, and a second identification with another R_s and seed."""
    root = tmp_path_factory.mktemp("studies")
    studies.write_identify(root / "first")
    studies.write_tune(root / "deep" / "tuned")
    studies.write_diagnose(root / "diagnosed")
    shutil.copytree(root / "first", root / "second")

    def change(result: dict[str, Any]) -> None:
        result["points"][1]["parameters"]["R_s"]["value"] += 0.095
        result["seed"] = 9

    edit(root / "second" / "result.json", change)
    edit(root / "second" / "study.json", lambda marker: marker["asked"].update(seed=9))
    return root


def edit(path: Path, change: Any) -> None:
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


def test_every_study_is_listed_with_its_outcome_and_its_stages_are_not(folder: Path) -> None:
    found = {entry.folder.name: entry for entry in list_studies(folder)}
    assert set(found) == {"first", "second", "tuned", "diagnosed"}
    assert (found["first"].kind, found["first"].scenario) == ("identify", "bench.toml")
    assert found["first"].outcome == "worst error 6 × noise"
    assert found["diagnosed"].outcome == "missing-effect: backlash"
    assert found["tuned"].outcome.startswith("cost ")


def test_a_damaged_study_is_listed_with_its_problem(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "result.json").write_text("{")
    (entry,) = list_studies(tmp_path)
    assert entry.status == "damaged"
    assert "is no JSON" in entry.problem


def test_a_difference_has_the_error_of_independent_estimates(folder: Path) -> None:
    found = compare([folder / "first", folder / "second"])
    row = next(r for r in found.rows if (r.name, r.at) == ("R_s", "25 °C"))
    difference = row.differences[1]
    assert difference is not None
    assert difference.value == pytest.approx(0.095)
    assert difference.stderr == pytest.approx(0.019 * 2**0.5)
    assert difference.z == pytest.approx(0.095 / (0.019 * 2**0.5))
    assert row.beyond_chance
    assert found.sentence() == "R_s differs beyond chance (|z| > 2)."
    assert dict(found.settings) == {"seed": ("7", "9")}


def test_what_the_data_do_not_determine_has_no_z(folder: Path) -> None:
    found = compare([folder / "first", folder / "second"])
    row = next(r for r in found.rows if (r.name, r.at) == ("T_fm", "−30 °C"))
    difference = row.differences[1]
    assert difference is not None
    assert (difference.stderr, difference.z) == (None, None)
    assert any("T_fm" in note for note in found.notes)


def test_an_effect_that_one_study_lacks_is_named(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "diagnosed", tmp_path / "other")
    edit(tmp_path / "other" / "result.json", lambda r: r.update(effects=[], verdict="no-missing-effect"))
    found = compare([folder / "diagnosed", tmp_path / "other"])
    assert "Only diagnosed found backlash" in found.sentence()
    assert dict(found.settings)["verdict"] == ("missing-effect", "no-missing-effect")


def test_different_units_are_not_subtracted(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "first", tmp_path / "milli")

    def milli(result: dict[str, Any]) -> None:
        result["points"][1]["parameters"]["R_s"].update(value=1900.0, unit="mohm")

    edit(tmp_path / "milli" / "result.json", milli)
    found = compare([folder / "first", tmp_path / "milli"])
    row = next(r for r in found.rows if (r.name, r.at) == ("R_s", "25 °C"))
    assert row.differences == (None, None)
    assert any("different units" in note for note in found.notes)


def test_studies_without_anything_in_common_are_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="share no parameter, effect or signal"):
        compare([folder / "first", folder / "deep" / "tuned"])
    with pytest.raises(InputError, match="two study folders"):
        compare([folder / "first"])
    with pytest.raises(InputError, match="is no folder"):
        compare([folder / "first", tmp_path / "none"])


def test_the_commands_print_tables_json_and_a_page(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run_command(["list", str(folder), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)) == 4
    assert cli.run_command(["list", str(folder)]) == 0
    assert "missing-effect: backlash" in capsys.readouterr().out
    both = ["compare", str(folder / "first"), str(folder / "second")]
    page = tmp_path / "page.html"
    assert cli.run_command([*both, "-o", str(page)]) == 0
    assert "R_s differs beyond chance" in capsys.readouterr().out
    text = page.read_text()
    assert "R_s differs beyond chance" in text
    assert cli.run_command([*both, "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    row = next(q for q in content["quantities"] if (q["name"], q["at"]) == ("R_s", "25 °C"))
    assert row["differences"]["second"]["difference"] == pytest.approx(0.095)
    assert content["settings"] == {"seed": {"first": "7", "second": "9"}}
    assert cli.run_command(["compare", str(folder / "first")]) == 2


def test_a_notebook_gets_tables(folder: Path) -> None:
    listed = tc.list_studies(folder)
    assert set(listed["kind"]) == {"identify", "tune", "diagnose"}
    table = tc.compare(folder / "first", folder / "second")
    assert table.loc[("parameter", "R_s", "25 °C"), ("second", "z")] == pytest.approx(3.5355, rel=1e-3)
    assert table.attrs["settings"] == {"seed": ("7", "9")}
