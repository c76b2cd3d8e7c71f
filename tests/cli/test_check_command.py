"""``thsa-cosim check PATH``: the path's ending says what is checked, and the exit code what came of it."""

import inspect
import json
import shutil
import zipfile
from pathlib import Path

import pytest
from fmu_sources import build

from thsa_cosim.check import check_fmu
from thsa_cosim.check.budget import TOTAL
from thsa_cosim.cli import run_command
from thsa_cosim.cli.check import check as check_command
from thsa_cosim.fmu import read_description
from thsa_cosim.fmu.probe import facts
from thsa_cosim.report.check import states

ROOT = Path(__file__).parents[2]


def test_a_recording_is_checked_by_its_ending(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["check", str(ROOT / "scenarios/recordings/motor_m30.parquet"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["kind"], report["verdict"], report["time"]) == ("recording", "ok", "time_s")
    assert report["data"] == {"verdict": "good", "findings": []}


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        pytest.param("motor", "identify", marks=pytest.mark.slow),
        ("table4", "tune"),
        pytest.param("actuator", "identify", marks=pytest.mark.slow),
    ],
)
def test_a_scenario_is_checked_by_its_ending(
    name: str, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(["check", str(ROOT / f"scenarios/{name}.toml"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["kind"], report["scenario"]["kind"]) == ("scenario", kind)
    assert report["data"]["verdict"] in ("good", "usable", "bad")
    lines = {line["name"]: line for line in report["fmu"]["findings"]}
    assert "the given inputs" in lines["runs"]["text"]
    assert lines["start values"]["text"].startswith("each of")


@pytest.mark.slow
def test_a_scenarios_own_start_values_are_no_fault_of_the_fmu(capsys: pytest.CaptureFixture[str]) -> None:
    """Parameters start in the middle of their bounds, not where the FMU declares them."""
    assert run_command(["check", str(ROOT / "scenarios/gearbox.toml"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert "declared values" not in json.dumps(found)
    assert found["verdict"] == "ok"


def test_options_of_an_fmu_and_the_exit_code_of_a_failed_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--duration", "0.5", "--step", "0.005", "--start", "tau=0.2", "--input", "u=3"]
    assert run_command(["check", str(build.lag2()), "--json", *options]) == 0
    report = json.loads(capsys.readouterr().out)
    runs = next(line for line in report["findings"] if line["name"] == "runs")
    assert "0.5 s in 100 steps" in runs["text"]
    assert (report["facts"]["state_names"], report["facts"]["started_states"]) == (["y"], ["y"])
    assert run_command(["check", str(build.lag2("CRASH_INSTANTIATE")), "--json"]) == 3
    assert json.loads(capsys.readouterr().out)["verdict"] == "failed"
    assert run_command(["check", str(build.lag2()), "--start", "tau"]) == 2
    assert "no NAME=VALUE" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("fmu", "says"),
    [
        ("EMPS", "s, w; these take a start value: controller.difference.z, controller.hold.z"),
        ("Motor", "motor.w_m, motor.phi; each takes a start value"),
        ("BrushlessMotor", "2: omega, i_m; none takes a start value"),
    ],
)
def test_states_are_listed_with_those_that_take_a_start_value(fmu: str, says: str) -> None:
    assert states(facts(read_description(ROOT / f"fmus/{fmu}.fmu"))).endswith(says)


def test_what_is_not_there_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a.fmu", "a.csv", "a.toml"):
        assert run_command(["check", str(tmp_path / name)]) == 2
        assert name in capsys.readouterr().err


def test_a_spreadsheet_is_answered_with_what_check_reads(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A workbook is a zip archive, too; an FMU may have any ending."""
    book, old = tmp_path / "run.xlsx", tmp_path / "run.xls"
    with zipfile.ZipFile(book, "w") as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")
    old.write_bytes(b"\xd0\xcf\x11\xe0")
    for path in (book, old):
        assert run_command(["check", str(path)]) == 2
        said = capsys.readouterr().err.strip()
        assert said.startswith(
            f"error: {path}: check reads FMUs (.fmu, .ssp), scenarios (.toml) and recordings (.csv, "
        )
        assert said.endswith("and this is none of them; save a table as .csv.")
    renamed = tmp_path / "lag.zip"
    shutil.copy(build.lag2("CRASH_INSTANTIATE"), renamed)
    assert run_command(["check", str(renamed), "--json"]) == 3


def test_the_command_and_the_function_have_the_same_limits() -> None:
    """The command's help shows them before the room that knows them is imported."""
    options = {option.name: option.default for option in check_command.params}
    own = inspect.signature(check_fmu).parameters
    assert options["deadline"] == own["deadline_s"].default
    assert options["time_limit"] == own["limit_s"].default == TOTAL


@pytest.mark.slow
@pytest.mark.parametrize("name", ["redundant_failure", "redundant_diagnosis"])
def test_the_redundant_actuators_scenarios_warn_of_nothing_in_their_fmu(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Failures that the start values put after the end of the recording; an energy balance near zero."""
    assert run_command(["check", str(ROOT / f"scenarios/{name}.toml"), "--json"]) == 0
    findings = json.loads(capsys.readouterr().out)["fmu"]["findings"]
    assert [f for f in findings if f["verdict"] not in ("ok", "not tried")] == []
