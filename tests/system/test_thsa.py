"""THSA cut at its current command, run as a system of two FMUs, against the whole actuator."""

import json
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from system.test_coupled import run
from thsa_cosim.fmu import Plant
from thsa_cosim.signals import Signals
from thsa_cosim.system.assemble import Part, Wire

FMUS = Path(__file__).parents[2] / "fmus"
WIRES = (Wire("controller.i_ref", "plant.i_ref"), Wire("plant.w_m", "controller.w_m"))
CONNECTORS = {"v_cmd": ["controller.v_cmd"], "F_load": ["plant.F_load"], "T_amb": ["plant.T_amb"]}
KNOTS = np.array([0.0, 0.1, 0.4, 1.0])
RAMP = Signals(
    KNOTS,
    {"v_cmd": np.array([0.0, 0.0, 9e-3, 9e-3]), "F_load": np.full(4, 55e3), "T_amb": np.full(4, -30.0)},
    {"v_cmd": "m/s", "F_load": "N", "T_amb": "degC"},
)
OUTPUTS = {"v": "plant.v", "w_m": "plant.w_m", "i_q": "plant.i_q"}


@pytest.fixture(scope="module")
def whole() -> Signals:
    from system.test_coupled import TIME

    with Plant.open(FMUS / "THSA.fmu", kind="model-exchange") as plant:
        return plant.run({}, RAMP, list(OUTPUTS), TIME, tolerance=1e-9)


def errors(
    folder: Path, whole: Signals, controller: Part, plant: Part, tolerance: float = 1e-8
) -> dict[str, float]:
    found = run(
        folder,
        [controller, plant],
        WIRES,
        list(OUTPUTS.values()),
        values={},
        inputs=RAMP,
        connectors=CONNECTORS,
        tolerance=tolerance,
    )
    return {n: float(np.max(np.abs(found[o] - whole[n])) / np.ptp(whole[n])) for n, o in OUTPUTS.items()}


def test_model_exchange_is_the_whole_to_the_solver_s_tolerance(tmp_path: Path, whole: Signals) -> None:
    parts = Part("controller", FMUS / "Controller.fmu"), Part("plant", FMUS / "Plant.fmu")
    assert max(errors(tmp_path, whole, *parts).values()) < 1e-7


@pytest.mark.parametrize("step", [1e-5, 1e-4, 2e-3])
def test_model_exchange_is_the_whole_at_any_communication_step(tmp_path: Path, step: float) -> None:
    """Through the start of a ramp, where the nut breaks away, at 10 µs to 2 ms."""
    time = np.linspace(0.0, 0.08, round(0.08 / step) + 1)
    inputs = Signals(
        np.array([0.0, 0.02, 0.08]),
        {"v_cmd": np.array([0.0, 0.0, 1.8e-3]), "F_load": np.full(3, 55e3), "T_amb": np.full(3, -30.0)},
        RAMP.units,
    )
    with Plant.open(FMUS / "THSA.fmu", kind="model-exchange") as plant:
        whole = plant.run({}, inputs, list(OUTPUTS), time, tolerance=1e-9)
    parts = Part("controller", FMUS / "Controller.fmu"), Part("plant", FMUS / "Plant.fmu")
    found = run(
        tmp_path,
        parts,
        WIRES,
        list(OUTPUTS.values()),
        values={},
        inputs=inputs,
        connectors=CONNECTORS,
        tolerance=1e-9,
        time=time,
    )
    for name, own in OUTPUTS.items():
        assert np.ptp(whole[name]) > 0.0
        assert np.max(np.abs(found[own] - whole[name])) < 1e-6 * np.ptp(whole[name])


def test_co_simulation_comes_nearer_by_four_when_its_step_is_halved(tmp_path: Path, whole: Signals) -> None:
    found = []
    for step in (1e-3, 5e-4):
        controller = Part("controller", FMUS / "Controller.fmu", "coupled", step)
        found.append(errors(tmp_path, whole, controller, Part("plant", FMUS / "Plant.fmu", "coupled", step)))
    for coarse, fine in pairwise(found):
        assert all(3.0 < coarse[name] / fine[name] < 5.0 for name in OUTPUTS)
    assert found[-1]["i_q"] < 5e-4


def test_a_sampled_controller_costs_what_its_delay_costs(tmp_path: Path, whole: Signals) -> None:
    """Sampling is a delay of the loop: its error is of first order in the period, and half a sample adds half."""
    found = []
    for step, delay in ((1e-3, 0.0), (5e-4, 0.0), (1e-3, 5e-4)):
        controller = Part("controller", FMUS / "Controller.fmu", "sampled", step, delay)
        plant = Part("plant", FMUS / "Plant.fmu", "coupled", 5e-4)
        found.append(errors(tmp_path, whole, controller, plant)["w_m"])
    assert found[0] / found[1] == pytest.approx(2.0, rel=0.1)
    assert found[2] / found[0] == pytest.approx(2.0, rel=0.25)


SCENARIO = """kind = "simulate"
{head}
[[components]]
name = "controller"
fmu = "{fmus}/Controller.fmu"
[[components]]
name = "plant"
fmu = "{fmus}/Plant.fmu"
[[connections]]
from = "controller.i_ref"
to = "plant.i_ref"
[[connections]]
from = "plant.w_m"
to = "controller.{target}"
[connectors]
v_cmd = "controller.v_cmd"
v = "plant.v"
[recordings]
validate = ["ramp.csv"]
[recordings.time]
column = "t"
unit = "s"
[recordings.columns."plant.F_load"]
value = 0.0
unit = "N"
[recordings.columns."plant.T_amb"]
value = 25.0
unit = "degC"
[recordings.columns.v_cmd]
column = "c"
unit = "m/s"
[recordings.columns.v]
column = "v"
unit = "m/s"
"""


def thsa_cosim(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "thsa_cosim.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def scenario(folder: Path, head: str = "", target: str = "w_m") -> Path:
    time = np.arange(0.0, 0.3, 1e-3)
    noise = np.random.default_rng(1).normal(0.0, 1e-6, time.size)
    rows = [f"{t:.4f},{0.03 * t:.6g},{n:.3g}" for t, n in zip(time, noise, strict=True)]
    (folder / "ramp.csv").write_text("\n".join(["t,c,v", *rows]) + "\n")
    path = folder / "system.toml"
    path.write_text(SCENARIO.format(head=head, fmus=FMUS.as_posix(), target=target))
    return path


@pytest.mark.parametrize("merge", ["true", "false"])
def test_a_scenario_runs_its_system_and_writes_it_for_others(tmp_path: Path, merge: str) -> None:
    path = scenario(tmp_path, f"merge = {merge}")
    done = thsa_cosim("simulate", path, "-o", tmp_path / "study", "--no-report", "--json")
    assert done.returncode == 0, done.stderr
    own = json.loads(done.stdout)["recordings"][0]["error"]["v"]["rmse"]
    assert own > 1e-4  # it moves
    done = thsa_cosim("export", "--ssp", path, "-o", tmp_path / "written.ssp")
    assert done.returncode == 0, done.stderr
    other = tmp_path / "other.toml"
    text = path.read_text()
    begin, end = text.index("[[components]]"), text.index("[recordings]")
    other.write_text(text[:begin] + 'fmu = "written.ssp"\n' + text[end:])
    done = thsa_cosim("simulate", other, "-o", tmp_path / "again", "--no-report", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["recordings"][0]["error"]["v"]["rmse"] == pytest.approx(own, rel=1e-9)


def test_a_study_says_what_its_communication_steps_cost(tmp_path: Path) -> None:
    """The error of second order falls to a quarter; a step that is too long is a reason not to trust the result."""
    changes, verdicts = [], []
    for step in (2e-3, 1e-3, 5e-4):
        path = scenario(tmp_path)
        steps = f'execution = "coupled"\nstep = {step}\n'
        path.write_text(path.read_text().replace('.fmu"\n', '.fmu"\n' + steps))
        study = tmp_path / f"study_{step}"
        done = thsa_cosim("simulate", path, "-o", study, "--no-report")
        assert done.returncode == 0, done.stderr
        assert "halving the communication steps changes v" in done.stdout
        result = json.loads((study / "result.json").read_text())
        changes.append(result["coupling"]["halved"]["v"]["rms"])
        verdicts.append(any("lower the steps" in reason for reason in result["trust"]["reasons"]))
    assert 3.0 < changes[1] / changes[2] < 6.0
    assert verdicts == [True, False, False]  # at 2 ms the coupled loop is close to its stability limit


@pytest.mark.parametrize(
    ("head", "target", "sentence"),
    [
        ('fmu = "x.fmu"', "w_m", "fmu and components exclude each other"),
        ("", "w_n", "has no variable 'w_n'. Did you mean 'w_m'?"),
        ("", "v_cmd", "cannot be turned into 'm/s'"),
    ],
)
def test_a_wrong_system_is_one_sentence(tmp_path: Path, head: str, target: str, sentence: str) -> None:
    done = thsa_cosim("simulate", scenario(tmp_path, head, target), "-o", tmp_path / "study")
    assert done.returncode == 2
    assert sentence in done.stderr
    assert done.stderr.count("\n") == 1
