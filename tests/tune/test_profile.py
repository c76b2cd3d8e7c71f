"""Tuning on recorded profiles: what drives the FMU, what the numbers mean, and tables that do not fit."""

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import thsa_cosim as tc
from thsa_cosim.errors import ScenarioError
from thsa_cosim.report.page import write_page
from thsa_cosim.scenario import load
from thsa_cosim.study import study_identity
from thsa_cosim.tune.problem import build_groups

ROOT = Path(__file__).parents[2]
RECORDINGS = ROOT / "scenarios" / "recordings"


def scenario(**changes: Any) -> dict[str, Any]:
    """``profile.toml`` with a tiny search and without the loop's margins."""
    content = tomllib.loads((ROOT / "scenarios" / "profile.toml").read_text(encoding="utf-8"))
    content["fmu"] = str(ROOT / "fmus" / "THSA.fmu")
    content["parameter_set"] = str(ROOT / "scenarios" / "parameters" / "identified.ssv")
    content["profile"]["recordings"] = [str(RECORDINGS / "driven_m30_a.parquet")]
    content["search"] |= {"population": 5, "generations": 1}
    content["requirements"] = [r for r in content["requirements"] if r["metric"] == "peak"]
    del content["loop"]
    return content | changes


def ramp(name: str, folder: Path, final: float = 9.0) -> Path:
    """A recording of a ramp that ends at ``final`` mm/s while the temperature rises from -55 to -45 degC in 2 s."""
    time = np.arange(0.0, 2.0, 0.01)
    command = np.minimum(30.0 * time, 9.0)
    command[-20:] = final
    rows = zip(time, command, np.full_like(time, 55.0), -55.0 + 5.0 * time, strict=True)
    path = folder / f"{name}.csv"
    header = "time_s,velocity_command_mm_s,load_kN,temperature_degC\n"
    path.write_text(header + "".join(",".join(f"{x:.9g}" for x in row) + "\n" for row in rows))
    return path


def test_recorded_signals_drive_the_fmu_in_its_units(tmp_path: Path) -> None:
    content = scenario()
    content["profile"]["recordings"] = [str(ramp("warming", tmp_path))]
    content["profile"]["columns"]["T_amb"]["smooth"] = "none"
    (group,) = build_groups(load(content))
    (case,) = group.cases
    drive = case.experiment.inputs
    assert drive["v_cmd"][-1] == pytest.approx(9e-3)
    assert np.interp(1.0, drive.time, drive["T_amb"]) == pytest.approx(-50.0)
    assert drive["F_load"] == pytest.approx(np.full(len(drive), 55e3))
    assert np.diff(drive.time) == pytest.approx(np.full(len(drive) - 1, 0.005))


def test_a_profile_that_stands_still_is_the_described_command(tmp_path: Path) -> None:
    """The same ramp, recorded and described: the same terms."""
    content = scenario(requirements=[])
    content["profile"]["recordings"] = [str(ramp("ramp", tmp_path))]
    content["command"] |= {"step": 0.01, "stop": 1.9}
    content["cost"] |= {"kappa_rise": 1000.0}
    tc.tune(content, folder=tmp_path / "recorded", workers=1, quiet=True)
    described = scenario(requirements=[], cost=content["cost"])
    del described["profile"]
    described["command"] |= {"shape": "ramp", "final": 9.0, "rate": 30.0, "step": 0.01, "stop": 1.9}
    described["conditions"] = {
        "T_amb": {"values": [-50.0], "unit": "degC"},
        "F_load": {"values": [55.0], "unit": "kN"},
    }
    tc.tune(described, folder=tmp_path / "described", workers=1, quiet=True)
    one, other = (
        json.loads((tmp_path / name / "result.json").read_text())["before"]
        for name in ("recorded", "described")
    )
    for term in ("rise_time", "tracking", "effort"):
        assert one[term] == pytest.approx(other[term], rel=0.01)


def test_every_recording_is_a_condition_and_its_end_does_not_count(tmp_path: Path) -> None:
    content = scenario()
    files = content["profile"]["recordings"]
    content["profile"]["recordings"] = [*files, files[0].replace("m30", "m55")]
    content["command"]["stop"] = 4.0
    study = tc.tune(content, folder=tmp_path / "study", workers=1, quiet=True)
    result = json.loads((tmp_path / "study" / "result.json").read_text())
    assert result["profiles"] == ["driven_m30_a", "driven_m55_a"]
    assert result["conditions"]["profile"]["values"] == [1.0, 2.0]
    assert result["before"]["rise_time"] is None  # the profile goes on
    assert result["before"]["tracking"] > 0.0
    assert {"driven_m30_a", "driven_m55_a"} <= {name.removeprefix("response_") for name in study.plots}
    response = study.signals("driven_m55_a")["v [mm/s]"]
    assert response["command"].abs().max() == pytest.approx(9.0)
    assert (response["before"] - response["command"]).abs().max() < 9.0


def test_the_content_of_a_recording_is_part_of_what_was_asked(tmp_path: Path) -> None:
    path = ramp("ramp", tmp_path)
    content = scenario()
    content["profile"]["recordings"] = [str(path)]
    first = study_identity(load(content))
    path.write_text(path.read_text().replace("0.5,9,55,", "0.5,9,54,"))
    second = study_identity(load(content))
    assert {key for key in first if first[key] != second[key]} == {"profile.recordings[ramp]"}


def test_damage_of_a_recorded_profile_is_told_but_not_that_its_temperature_moves(tmp_path: Path) -> None:
    """A sentinel in the load would drive the model with it."""
    content = scenario()
    content["profile"]["recordings"] = [str(ramp("warming", tmp_path))]
    assert load(content).data.findings == ()
    table = pd.read_parquet(RECORDINGS / "driven_m30_a.parquet")
    for begin in (2000, 9000, 15000):
        table.loc[begin : begin + 40, "load_kN"] = -9999.0
    table.to_parquet(tmp_path / "damaged.parquet")
    content["profile"]["recordings"] = [str(tmp_path / "damaged.parquet")]
    content["command"]["stop"] = 2.0
    study = tc.tune(content, folder=tmp_path / "study", workers=1, quiet=True)
    data = json.loads((study.folder / "result.json").read_text())["data"]
    assert ("sentinel", "F_load") in {(f["kind"], f["channel"]) for f in data["findings"]}
    assert data["verdict"] != "good"
    assert "Data and trust" in write_page(study.folder).read_text(encoding="utf-8")


def remove_profile(content: dict[str, Any]) -> None:
    del content["profile"]


def remove_command(content: dict[str, Any]) -> None:
    del content["profile"]["columns"]["v_cmd"]


def describe_command(content: dict[str, Any]) -> None:
    content["command"] |= {"shape": "step", "final": 9.0, "stop": 1.0}


def require_rise(content: dict[str, Any]) -> None:
    content["requirements"] = [{"metric": "rise_time", "maximum": 0.3}]


def repeat_input(content: dict[str, Any]) -> None:
    content["conditions"] = {"F_load": {"values": [1.0], "unit": "kN"}}


def drive_output(content: dict[str, Any]) -> None:
    content["profile"]["columns"]["v"] = {"column": "velocity_mm_s", "unit": "mm/s"}


def forget_input(content: dict[str, Any]) -> None:
    del content["profile"]["columns"]["T_amb"]


def miss_files(content: dict[str, Any]) -> None:
    content["profile"]["recordings"] = ["nothing_*.parquet"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (remove_profile, r"needs the table \[profile\]"),
        (remove_command, r"profile\.columns\.v_cmd is the command's input; add its column"),
        (describe_command, r"profile\.columns\.v_cmd is the command's input; remove its column"),
        (require_rise, r"requirements\[1\]\.rise_time: .* does not end at its largest value"),
        (repeat_input, r"conditions\.F_load is a column of \[profile\] as well"),
        (drive_output, r"profile\.columns\.v"),
        (forget_input, r"conditions\.T_amb is missing"),
        (miss_files, r"profile\.recordings: 'nothing_\*\.parquet' matches no file"),
    ],
)
def test_a_table_that_does_not_fit_is_one_sentence(change: Any, message: str) -> None:
    content = scenario()
    change(content)
    with pytest.raises(ScenarioError, match=message):
        load(content)
