"""The use case behind ``thsa-cosim simulate``."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fmu.test_plant import lag
from fmu_sources import build

from thsa_cosim.errors import StudyError
from thsa_cosim.scenario import Executor, load
from thsa_cosim.simulate import simulate
from thsa_cosim.study import Place

TIME = np.linspace(0.0, 1.0, 201)
INPUT = np.sin(5.0 * TIME)
NOISE = 1e-3


@pytest.fixture
def scenario_file(tmp_path: Path) -> Path:
    random = np.random.default_rng(5)
    for name, tau in (("first", 0.1), ("second", 0.3)):
        y = lag(TIME, INPUT, tau, 1.0) + NOISE * random.normal(size=TIME.size)
        pd.DataFrame({"t": TIME, "command": INPUT, "speed": y}).to_csv(tmp_path / f"{name}.csv", index=False)
    path = tmp_path / "scenario.toml"
    path.write_text(
        f"""
        kind = "simulate"
        fmu = "{build.lag2()}"
        [recordings]
        fit = ["first.csv"]
        validate = ["second.csv"]
        [recordings.time]
        column = "t"
        unit = "s"
        [recordings.columns.u]
        column = "command"
        unit = "m/s"
        [recordings.columns.y]
        column = "speed"
        unit = "m/s"
        [fixed]
        tau = 0.1
        [simulation]
        deadline = 5.0
        """
    )
    return path


def test_every_recording_is_simulated_and_compared(scenario_file: Path, tmp_path: Path) -> None:
    told: list[str] = []
    folder = tmp_path / "study"
    place = Place(folder, Executor(2), lambda progress: told.append(progress.stage))
    result = simulate(load(scenario_file), place)
    assert told == ["1 of 2 recordings simulated", "2 of 2 recordings simulated"]
    first, second = result.recordings
    assert (first.role, second.role) == ("fit", "validate")
    # The first recording was made with this time constant, the second with three times as much.
    assert first.errors["y"].rmse == pytest.approx(NOISE, rel=0.15)
    assert first.errors["y"].noise == pytest.approx(NOISE, rel=0.3)
    assert second.errors["y"].rmse > 50 * NOISE
    assert second.errors["y"].unit == "m/s"
    content = json.loads((folder / "result.json").read_text())
    assert content == result.to_dict()
    assert content["kind"] == "simulate"
    assert content["failures"] == {}
    table = pd.read_csv(folder / "fit_first.csv")
    assert list(table.columns)[:3] == ["time [s]", "y [m/s]", "y measured [m/s]"]
    assert np.max(np.abs(table["y [m/s]"] - lag(TIME, INPUT, 0.1, 1.0))) < 1e-12


def test_communication_step_of_the_scenario(scenario_file: Path, tmp_path: Path) -> None:
    scenario_file.write_text(scenario_file.read_text() + "\nstep = 0.01\n")
    result = simulate(load(scenario_file), Place(tmp_path / "study"))
    simulated = result.recordings[0].simulated
    assert simulated is not None
    assert simulated.time.size == 101
    assert result.recordings[0].errors["y"].rmse < 2e-3


def test_failures_are_part_of_the_result_unless_all_fail(scenario_file: Path, tmp_path: Path) -> None:
    good = scenario_file.read_text()
    scenario_file.write_text(good.replace("tau = 0.1", f"tau = 0.1\nfault = {build.FAULTS['nan']}\nat = 0.9"))
    short = pd.read_csv(tmp_path / "first.csv").iloc[:150]
    short.to_csv(tmp_path / "first.csv", index=False)
    result = simulate(load(scenario_file), Place(tmp_path / "study"))
    assert [r.status for r in result.recordings] == ["ok", "not-finite"]
    assert list(result.failures.values()) == [1]
    assert result.recordings[1].errors == {}
    scenario_file.write_text(good.replace("tau = 0.1", f"tau = 0.1\nfault = {build.FAULTS['error']}\nat = 0"))
    with pytest.raises(StudyError, match="All 2 simulations failed, 2 of them because fmi2DoStep returned"):
        simulate(load(scenario_file), Place(tmp_path / "other"))


def test_a_signal_that_comes_late_is_named_and_what_fits_has_no_finding(
    scenario_file: Path, tmp_path: Path
) -> None:
    table = pd.read_csv(tmp_path / "first.csv")
    table["speed"] = table["speed"].shift(4).bfill()
    table.to_csv(tmp_path / "late.csv", index=False)
    files = [str(tmp_path / "first.csv"), str(tmp_path / "late.csv")]
    result = simulate(load(scenario_file, fit=files, validate=[]), Place(tmp_path / "study"))
    slips = [f for f in result.data.findings if f.kind == "delay"]
    assert [(f.recording, f.channel) for f in slips] == [("late", "y")]
    assert float(slips[0].remedy.rpartition("= ")[2]) == pytest.approx(-0.02, rel=0.1)
    content = json.loads((tmp_path / "study" / "result.json").read_text())
    assert "delay" in [f["kind"] for f in content["data"]["findings"]]
