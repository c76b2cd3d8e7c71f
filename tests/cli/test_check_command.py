"""``thsa-cosim check PATH``: the path's ending says what is checked, and the exit code what came of it."""

import json
from pathlib import Path

import pytest

from thsa_cosim.cli import run_command

ROOT = Path(__file__).parents[2]


def test_a_recording_is_checked_by_its_ending(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["check", str(ROOT / "scenarios/recordings/motor_m30.parquet"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["kind"], report["verdict"], report["time"]) == ("recording", "ok", "time_s")
    assert report["data"] == {"verdict": "good", "findings": []}


@pytest.mark.parametrize(
    ("name", "kind"), [("motor", "identify"), ("table4", "tune"), ("actuator", "identify")]
)
def test_a_scenario_is_checked_by_its_ending(
    name: str, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(["check", str(ROOT / f"scenarios/{name}.toml"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["kind"], report["scenario"]["kind"]) == ("scenario", kind)
    assert report["data"]["verdict"] in ("good", "usable", "bad")


def test_what_is_not_there_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a.fmu", "a.csv", "a.toml"):
        assert run_command(["check", str(tmp_path / name)]) == 2
        assert name in capsys.readouterr().err
