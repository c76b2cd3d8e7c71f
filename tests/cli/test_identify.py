"""``thsa-cosim identify``: results, resuming after Ctrl-C and SIGKILL, refusals.

What depends on a process of its own (the first run, kills) is a subprocess; the rest calls the same entry here.
"""

import json
import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from thsa_cosim import cli
from thsa_cosim.ssv import read_ssv

ROOT = Path(__file__).parents[2]
MOTOR = ROOT / "scenarios" / "motor.toml"
pytestmark = pytest.mark.skipif(
    not (ROOT / "fmus" / "Motor.fmu").exists(), reason="fmus/Motor.fmu has not been exported"
)
TRUE = {
    -30.0: {"R_s": 0.498, "psi_pm": 0.0946, "T_fm": 0.0561, "b_m": 4.57e-5},
    25.0: {"R_s": 1.915625, "psi_pm": 0.099, "T_fm": 0.04125, "b_m": 4.83e-5},
}


def small_scenario(folder: Path, points: tuple[str, ...] = ("m30", "p25"), **replacements: str) -> Path:
    """The motor bench's first 3 s at a few temperatures, with a population of 12 over 8 generations."""
    text = MOTOR.read_text()
    recordings = [str(ROOT / "scenarios" / "recordings" / f"motor_{p}.parquet") for p in points]
    changes = {
        '"../fmus/Motor.fmu"': json.dumps(str(ROOT / "fmus" / "Motor.fmu")),
        '["recordings/motor_*.parquet"]': json.dumps(recordings),
        "population = 45": "population = 12",
        "generations = 30": "generations = 8",
        "[recordings.time]\n": "[recordings.time]\nstop = 3.0\n",
        'form = "cubic"': 'form = "linear", published_form = "cubic"',
        'form = "quadratic"': 'form = "linear", published_form = "quadratic"',
        'form = "double-exponential"': 'form = "linear", published_form = "double-exponential"',
        **replacements,
    }
    for old, new in changes.items():
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "small.toml"
    path.write_text(text)
    return path


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "thsa_cosim.cli", *map(str, arguments)]


def run(*arguments: object, **options: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command(*arguments), capture_output=True, text=True, timeout=300, check=False, **options
    )


class Here:
    """Command lines in this process: exit code, stdout and stderr; plots are left empty to save their time."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys

    def __call__(self, *arguments: object) -> subprocess.CompletedProcess[str]:
        self._capsys.readouterr()
        code = cli.run_command([str(a) for a in arguments])
        captured = self._capsys.readouterr()
        return subprocess.CompletedProcess(arguments, code, captured.out, captured.err)


@pytest.fixture
def here(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Here:
    monkeypatch.setattr(Figure, "savefig", lambda self, path, **_: Path(path).touch())
    return Here(capsys)


def result_of(folder: Path) -> dict:
    return json.loads((folder / "result.json").read_text())


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, subprocess.CompletedProcess[str]]:
    """A scenario, its undisturbed study, and what the command printed."""
    folder = tmp_path_factory.mktemp("identify")
    scenario = small_scenario(folder)
    held_out = ROOT / "scenarios" / "recordings" / "motor_m10.parquet"
    done = run("identify", scenario, "--validate", held_out, "-o", folder / "study", "--workers", 2)
    assert done.returncode == 0, done.stderr
    return scenario, folder / "study", done


def test_parameters_and_laws_meet_the_truth_within_their_errors(study) -> None:
    result = result_of(study[1])
    assert (result["kind"], result["status"]) == ("identify", "complete")
    assert [p["temperature_degC"] for p in result["points"]] == [-30.0, 25.0]
    for point in result["points"]:
        for name, true in TRUE[point["temperature_degC"]].items():
            found = point["parameters"][name]
            assert found["identifiable"]
            assert abs(found["value"] - true) < 4.0 * found["stderr"], name
            assert found["stderr"] < 0.3 * true
        assert 0.9 < point["cost_per_sample"] < 1.1
    for name, law in result["laws"].items():
        assert law["form"] == "linear"
        assert len(law["coefficients"]) == 2
        assert set(law["at"]) == {"-30.0", "25.0"}
        assert law["unit"] == result["points"][0]["parameters"][name]["unit"]
    for channel in ("i_q", "u_q", "w_m"):
        error = result["error"]["fit"][channel]
        assert error["rmse"] == pytest.approx(error["noise"], rel=0.05)
    assert "i_q" in result["error"]["validate"]


def test_the_study_folder_holds_readable_tables_and_plots(study) -> None:
    folder, result = study[1], result_of(study[1])
    parameters = pd.read_csv(folder / "parameters.csv")
    assert len(parameters) == 8
    assert parameters.loc[0, "value"] == result["points"][0]["parameters"]["R_s"]["value"]
    laws = pd.read_csv(folder / "laws.csv")
    assert laws["temperature_degC"].tolist() == list(np.arange(-30.0, 25.5))
    assert laws["R_s [ohm]"].iloc[0] == pytest.approx(result["laws"]["R_s"]["at"]["-30.0"])
    journal = pd.read_csv(folder / "journal.csv")
    assert {"R_s", "psi_pm", "T_fm", "b_m", "cost", "cost.i_q", "status"} <= set(journal.columns)
    assert "parameter Real 'motor.R_s.a0'(unit=" in (folder / "Identified.mo").read_text()
    identified = read_ssv(folder / "identified.ssv")
    assert identified.values["motor.R_s.a1"] == result["laws"]["R_s"]["coefficients"][1]
    assert identified.units["motor.R_s.a0"] == "Ohm"
    plots = {p.name for p in (folder / "plots").iterdir()}
    friction = pd.read_csv(folder / "friction_motor.csv")
    at_rest = friction[(friction["speed [rad/s]"] == 0.0) & (friction["temperature_degC"] == -30.0)]
    assert at_rest["friction [N.m]"].item() == pytest.approx(result["laws"]["T_fm"]["at"]["-30.0"])
    assert {
        "friction_motor.png",
        "law_R_s.png",
        "fit_motor_m30.png",
        "validate_motor_m10.png",
        "convergence.png",
    } <= plots


def test_tables_are_printed_plainly_into_a_pipe(study) -> None:
    out, err = study[2].stdout, study[2].stderr
    for words in ("Laws over temperature", "published", "psi_pm", "± one standard error", "result.json"):
        assert words in out
    assert "\x1b" not in out + err
    assert "0 failed" in err


def test_the_finished_study_is_shown_again(study, here: Here) -> None:
    scenario, folder, first = study
    held_out = ROOT / "scenarios" / "recordings" / "motor_m10.parquet"
    words = ("identify", scenario, "--validate", held_out, "-o", folder, "--workers", 1)
    before, result = (folder / "journal.csv").read_bytes(), result_of(folder)
    again = here(*words)
    assert again.returncode == 0, again.stderr
    assert again.stdout == first.stdout
    assert "nothing is simulated" in again.stderr
    assert "runs" not in again.stderr
    assert json.loads(here(*words, "--json", "--quiet").stdout) == result == result_of(folder)
    assert (folder / "journal.csv").read_bytes() == before


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_an_ended_study_continues_to_the_undisturbed_result(
    study, here: Here, tmp_path: Path, how: int
) -> None:
    scenario, folder, _ = study
    held_out = ROOT / "scenarios" / "recordings" / "motor_m10.parquet"
    arguments = ("identify", scenario, "--validate", held_out, "-o", tmp_path / "study", "--workers", 2)
    process = subprocess.Popen(
        command(*arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    journal = tmp_path / "study" / "journal.csv"
    deadline = time.monotonic() + 120.0
    while not (journal.exists() and journal.read_bytes().count(b"\n") > 30):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.02)
    os.kill(process.pid, how)
    out, err = process.communicate(timeout=60)
    if how == signal.SIGINT:
        assert process.returncode == 130
        assert "Traceback" not in err
        assert f"continue with: thsa-cosim identify {scenario}" in err
        assert result_of(tmp_path / "study")["status"] == "interrupted"
        assert out == ""
    else:
        assert not (tmp_path / "study" / "result.json").exists()
    done = here(*arguments)
    assert done.returncode == 0, done.stderr
    assert result_of(tmp_path / "study") == result_of(folder)


def test_another_seed_or_scenario_is_refused_in_the_same_folder(study, here: Here, tmp_path: Path) -> None:
    scenario, folder, _ = study
    refused = here("identify", scenario, "-o", folder, "--seed", 99)
    assert refused.returncode == 2
    assert refused.stderr.startswith("error: ")
    assert refused.stderr.count("\n") == 1
    other = small_scenario(tmp_path, **{"upper = 5.0": "upper = 4.0"})
    held_out = ROOT / "scenarios" / "recordings" / "motor_m10.parquet"
    refused = here("identify", other, "--validate", held_out, "-o", folder)
    assert refused.returncode == 2
    assert (
        "holds a study with parameters[R_s].upper = 5.0; this one has parameters[R_s].upper = 4.0"
        in refused.stderr
    )
    assert "choose another folder with -o" in refused.stderr


def test_without_current_nor_speed_the_friction_is_not_determined(here: Here, tmp_path: Path) -> None:
    """Steady speed shows friction in the current only; the voltage holds R_s times that current."""
    scenario = small_scenario(
        tmp_path,
        points=("p25",),
        **{
            '[cost.channels.i_q]\nnoise = "estimate"\n': "",
            '[cost.channels.u_q]\nnoise = "estimate"\n': "",
            "[recordings.time]\n": "[recordings.time]\nstop = 0.6\n",
        },
    )
    text = scenario.read_text().replace("stop = 0.6\nstop = 3.0\n", "stop = 0.6\n")
    scenario.write_text(text.replace("stop = 3.0\nstop = 0.6\n", "stop = 0.6\n"))
    done = here("identify", scenario, "-o", tmp_path / "study")
    assert done.returncode == 0, done.stderr
    (point,) = result_of(tmp_path / "study")["points"]
    undetermined = {n: p for n, p in point["parameters"].items() if not p["identifiable"]}
    assert {"R_s", "b_m"} <= set(undetermined)  # the motor rests during the first 0.7 s
    assert all(p["reason"] for p in undetermined.values())
    assert "not determined by these data" in done.stdout


def test_a_model_that_never_runs_is_exit_code_3(here: Here, tmp_path: Path) -> None:
    broken = tmp_path / "Motor.fmu"
    with zipfile.ZipFile(ROOT / "fmus" / "Motor.fmu") as whole, zipfile.ZipFile(broken, "w") as archive:
        for name in whole.namelist():
            archive.writestr(name, b"no library" if name.startswith("binaries/") else whole.read(name))
    scenario = small_scenario(tmp_path, ("p25",), **{"population = 45": "population = 5"})
    done = here("identify", scenario, "--fmu", broken, "-o", tmp_path / "study")
    assert done.returncode == 3
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("error: ")
    assert "no simulation succeeded: all of the first 5 simulations failed" in last
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_ten_kills_at_random_moments_change_nothing(study, tmp_path: Path) -> None:
    """Anything from the first import to the last plot may be cut short, again and again."""
    scenario, folder, _ = study
    held_out = ROOT / "scenarios" / "recordings" / "motor_m10.parquet"
    arguments = ("identify", scenario, "--validate", held_out, "-o", tmp_path / "study", "--workers", 2)
    random = np.random.default_rng(20)
    begin = time.monotonic()
    rows = 0
    for _ in range(10):
        process = subprocess.Popen(
            command(*arguments), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True
        )
        # Up to what a whole run takes, so that early and late stages are hit alike.
        try:
            process.wait(random.uniform(0.2, 12.0))
        except subprocess.TimeoutExpired:
            os.kill(process.pid, signal.SIGKILL)
        _, err = process.communicate(timeout=60)
        assert process.returncode in (0, -signal.SIGKILL), err
        journal = tmp_path / "study" / "journal.csv"
        if journal.exists():
            found = journal.read_bytes().count(b"\n")
            assert found >= rows - 1  # a torn last line is dropped, nothing else
            rows = found
    done = run(*arguments)
    assert done.returncode == 0, done.stderr
    assert result_of(tmp_path / "study") == result_of(folder)
    table = pd.read_csv(tmp_path / "study" / "journal.csv")
    assert not table.duplicated(["stage", "R_s", "psi_pm", "T_fm", "b_m"]).any()
    assert len(table) == len(pd.read_csv(folder / "journal.csv"))
    assert time.monotonic() - begin < 400.0
