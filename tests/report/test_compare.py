"""Studies of a folder in a list, and what differs between some of them."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import report_studies as studies

import thsa_cosim as tc
from thsa_cosim import cli
from thsa_cosim.errors import InputError
from thsa_cosim.report.compare import compare, list_studies
from thsa_cosim.report.compare.watch import alone, drift_of, jump_of, limits, single_of


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
    assert row.beyond(3.5)
    assert not row.beyond(3.6)
    assert found.sentence() == "R_s rose by 5 ± 1 %; no other value differs beyond chance (|z| > 2.39)."
    assert dict(found.settings) == {"seed": ("7", "9")}


def test_what_the_data_do_not_determine_has_no_z(folder: Path) -> None:
    found = compare([folder / "first", folder / "second"])
    row = next(r for r in found.rows if (r.name, r.at) == ("T_fm", "−30 °C"))
    difference = row.differences[1]
    assert difference is not None
    assert (difference.stderr, difference.z) == (None, None)
    assert any("T_fm" in note for note in found.notes)


def test_what_rises_from_nothing_is_a_difference(folder: Path, tmp_path: Path) -> None:
    """A stiffness that cannot be distinguished from zero in one study, and is 1.82 in the other."""
    for name, value, why in (("bare", -1e-3, "it cannot be distinguished from zero"), ("spring", 1.82, "")):
        shutil.copytree(folder / "first", tmp_path / name)
        own = {"value": value, "stderr": 2e-3, "unit": "N.m/rad", "identifiable": not why, "reason": why}

        def add(result: dict[str, Any], own: dict[str, Any] = own) -> None:
            result["points"][1]["parameters"]["c"] = own

        edit(tmp_path / name / "result.json", add)
    sentence = compare([tmp_path / "bare", tmp_path / "spring"]).sentence()
    assert sentence.startswith("c rose from -0.0010 ± 0.0020 to 1.8200 ± 0.0020 N.m/rad; no other value")


def test_the_surest_difference_comes_first_and_a_model_that_leaves_more_than_noise_is_said(
    folder: Path, tmp_path: Path
) -> None:
    shutil.copytree(folder / "second", tmp_path / "other")

    def change(result: dict[str, Any]) -> None:
        result["points"][1]["parameters"]["T_fm"]["value"] *= 2.0
        result["trust"] = {"verdict": "not-explained", "reasons": []}

    edit(tmp_path / "other" / "result.json", change)
    found = compare([folder / "first", tmp_path / "other"])
    assert found.sentence().startswith("T_fm rose by 100 ")
    assert "; R_s rose by 5 " in found.sentence()
    assert found.sentence().endswith("; this is in doubt, since the model leaves more than noise in other.")
    assert any("more than noise in other" in note for note in found.notes)


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
    assert "R_s rose by 5 ± 1 %" in capsys.readouterr().out
    text = page.read_text()
    assert "R_s rose by 5 ± 1 %" in text
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


def test_the_amplitude_of_a_ripple_is_compared_and_not_its_parts(folder: Path, tmp_path: Path) -> None:
    """The sine and cosine part of 3 and 4, ± 0.1 each, have 5 ± 0.1 together; a fifth of it has fallen by 80 %."""
    for name, factor in (("first", 1.0), ("second", 0.2)):
        shutil.copytree(folder / name, tmp_path / name)

        def change(content: dict[str, Any], factor: float = factor) -> None:
            for part, value in (("a_s", 3.0), ("a_c", 4.0)):
                number = {"value": factor * value, "unit": "N.m", "stderr": 0.1, "identifiable": True}
                content["points"][0]["parameters"][f"cogging:motor.{part}"] = number

        edit(tmp_path / name / "result.json", change)
    found = compare([tmp_path / "first", tmp_path / "second"])
    row = next(r for r in found.rows if r.name == "cogging:motor.amplitude")
    first, second = row.values
    assert first is not None
    assert second is not None
    assert (row.group, first.value, second.value) == ("effect", pytest.approx(5.0), pytest.approx(1.0))
    assert first.stderr == pytest.approx(0.1)
    assert "cogging:motor.amplitude fell by 80 ± 2 %" in found.sentence()
    assert "a_s" not in found.sentence()


def values_of_unit(folder: Path, first: Path, values: list[float]) -> list[str]:
    """Studies of one unit, whose R_s at every temperature is given."""
    made = []
    for week, value in enumerate(values):
        shutil.copytree(first, folder / f"week{week:02d}")

        def change(content: dict[str, Any], value: float = value) -> None:
            for point in content["points"]:
                point["parameters"]["R_s"]["value"] = value

        edit(folder / f"week{week:02d}" / "result.json", change)
        made.append(str(folder / f"week{week:02d}"))
    return made


SUSPECT = "No alarm. R_s at −30 °C is 2 ohm, where 1 ±"


@pytest.mark.parametrize(
    ("last", "alarm"),
    [
        ([1.01], "No alarm."),
        ([2.0], SUSPECT),
        ([1.0, 2.0], SUSPECT),
        ([2.0, 0.98], "No alarm."),
        ([1.9, 2.0], "Alarm: R_s at −30 °C is 2 ohm, where 1 ±"),
    ],
)
def test_a_unit_is_watched_over_time(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], last: list[float], alarm: str
) -> None:
    weeks = values_of_unit(tmp_path, folder / "first", [0.98, 1.02, 1.01, 0.99, 1.0, 1.02, 0.98, 1.0, *last])
    assert cli.run_command(["compare", *weeks, "--watch", "-o", str(tmp_path / "page.html")]) == 0
    assert alarm in capsys.readouterr().out.replace("\n", " ")
    assert alarm in (tmp_path / "page.html").read_text()
    assert cli.run_command(["compare", *weeks, "--watch", "--json"]) == 0
    trends = json.loads(capsys.readouterr().out)["trends"]
    raised = {t["name"] for t in trends if t["alarm"]}
    assert raised == ({"R_s"} if alarm.startswith("Alarm") else set())


def test_three_studies_are_no_trend(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    weeks = values_of_unit(tmp_path, folder / "first", [1.0, 1.1, 1.2])
    assert cli.run_command(["compare", *weeks, "--watch"]) == 2
    assert "A trend needs 4 studies or more" in capsys.readouterr().err


def test_an_alarm_is_false_once_a_unit_and_year() -> None:
    """The chance that the limits leave to each quantity and week, added up over a year, against random numbers."""
    rng, weeks, raised = np.random.default_rng(1), (5, 12, 52), 0
    units = 3000
    for week in weeks:
        jump, drift = limits(week, 1)
        for values in rng.standard_normal((units, week)):
            j, d = jump_of(values), drift_of(values)[0]
            assert j is not None
            assert d is not None
            raised += abs(j) > jump or abs(d) > drift
    assert raised * 52 / (units * len(weeks)) == pytest.approx(1.0, abs=0.3)


def test_heavy_tails_raise_no_more_alarms() -> None:
    """Student's t with three degrees of freedom: one week alone would raise three alarms in place of each."""
    rng, weeks, units = np.random.default_rng(2), 30, 20000
    jump, single = limits(weeks, 12)[0], alone(weeks, 12)
    values = rng.standard_t(3, (units, weeks))
    twice = np.mean([abs(jump_of(own) or 0.0) > jump for own in values])
    once = np.mean([abs(single_of(own)[0] or 0.0) > single for own in values])
    chance = 0.5 / (52 * 12)
    assert once > 6.0 * chance
    assert twice < 3.0 * chance


def fleet_of(folder: Path, first: Path, last: dict[str, float]) -> list[str]:
    """Six weeks of each unit; the units' R_s differ a little, and the last two weeks of each are shifted."""
    made = []
    for k, (unit, shift) in enumerate(last.items()):
        level = 1.0 + 0.01 * k
        values = [level * x for x in (0.995, 1.0, 1.005, 1.0, 1.0 + shift, 1.003 + shift)]
        made += values_of_unit(folder / unit, first, values)
    return made


def test_a_fleet_is_watched_unit_by_unit(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    units = dict.fromkeys(("left", "right", "spare", "test", "old"), 0.0)
    weeks = fleet_of(tmp_path / "calm", folder / "first", units)
    assert cli.run_command(["compare", *weeks, "--watch"]) == 0
    told = capsys.readouterr().out.replace("\n", " ")
    assert "No alarm." in told
    assert "Unlike the others" not in told
    weeks = fleet_of(tmp_path / "worn", folder / "first", {**units, "spare": 0.8})
    assert cli.run_command(["compare", *weeks, "--watch", "--json", "-o", str(tmp_path / "page.html")]) == 0
    shown = json.loads(capsys.readouterr().out)
    raised = {t["name"] for t in shown["trends"] if t["alarm"]}
    assert raised == {"spare: R_s"}
    assert {(o["unit"], o["name"]) for o in shown["odd"]} == {("spare", "R_s")}
    assert "Unlike the others: R_s at −30 °C of spare is 1." in (tmp_path / "page.html").read_text()


def test_a_unit_with_few_studies_is_no_fleet(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    weeks = fleet_of(tmp_path, folder / "first", {"left": 0.0, "right": 0.0})
    assert cli.run_command(["compare", *weeks[:-3], "--watch"]) == 2
    assert "folder right holds 3 of the studies, and a trend needs 4" in capsys.readouterr().err
