"""The force residual in a study: what the scenario needs for it, and what an identification says of it."""

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from thsa_cosim.errors import ScenarioError
from thsa_cosim.fmu import Plant
from thsa_cosim.identify import force_balance
from thsa_cosim.scenario import ForceSpec, load
from thsa_cosim.signals import Signals
from thsa_cosim.study import Comparison

ROOT = Path(__file__).parents[2]
EMPS = ROOT / "scenarios" / "emps.toml"
SPEC = ForceSpec(position="q", force="F", mass="M", mass_at_start=95.0, period=2.0)
STEP, TIME = 1e-3, np.arange(0.0, 6.0, 1e-3)
TRUE = {"M": 120.0, "F_v": 320.0, "F_c": 12.0, "F_0": 4.0}


def reference() -> np.ndarray:
    """Laps of 1 s, in motion at the start [m]."""
    return 0.01 * np.sin(2 * np.pi * TIME + 0.4) + 0.001 * np.sin(2 * np.pi * TIME * 3.0)


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The drive with other parameters than the FMU's, as MATLAB saves a workspace; F_load is no part of it."""
    path = tmp_path_factory.mktemp("force") / "RECORD.mat"
    drive = Signals(TIME, {"q_ref": reference(), "F_load": 0.0 * TIME})
    with Plant.open(ROOT / "fmus" / "EMPS.fmu") as plant:
        run = plant.run(TRUE, drive, ("q", "vir"), TIME)
    noise = np.random.default_rng(1).normal(0.0, 0.01, TIME.size)
    columns = {"t": TIME, "qg": reference(), "qm": run["q"], "vir": run["vir"] + noise}
    savemat(path, {**{name: values[:, None] for name, values in columns.items()}, "kp": 160.18})
    return path


def shortened(folder: Path, text: str = "", old: str = "", new: str = "") -> Path:
    """scenarios/emps.toml for the short record, with ``old`` replaced by ``new`` and ``text`` at its end."""
    content = EMPS.read_text().replace("../fmus", str(ROOT / "fmus"))
    for long, short in (
        ("18.7195", "3.9995"),
        ("period = 6.24", "period = 1.0"),
        ("population = 15", "population = 8"),
        ("generations = 20", "generations = 3"),
    ):
        assert long in content
        content = content.replace(long, short)
    assert old in content
    (folder / "short.toml").write_text(content.replace(old, new) + text)
    return folder / "short.toml"


def test_identify_finds_the_drive_and_a_residual_of_nothing_but_noise(record: Path, tmp_path: Path) -> None:
    scenario = shortened(tmp_path)
    command = [
        sys.executable,
        "-m",
        "thsa_cosim.cli",
        "identify",
        scenario,
        "--fit",
        record,
        "-o",
        tmp_path / "study",
    ]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "study" / "result.json").read_text())
    found = result["points"][0]["parameters"]
    for name, true in TRUE.items():
        assert abs(found[name]["value"] - true) < 4 * found[name]["stderr"], name
        assert found[name]["stderr"] < 0.05 * abs(true)
    assert [r["name"] for r in result["recordings"]] == ["RECORD laps 1-3", "RECORD lap 4"]
    force = result["force_residual"]
    # White noise of 0.35 N up to 500 Hz leaves a share of 20/500 of its power below 20 Hz.
    assert force["rms"] == pytest.approx(
        dict.fromkeys(("fit", "validate"), 0.35 * math.sqrt(20 / 500)), rel=0.25
    )
    assert force["repeatability"] == pytest.approx(force["rms"]["fit"], rel=0.25)  # nothing repeats
    assert "Force residual below 20 Hz" in done.stdout


def comparison(role: str, lacking: np.ndarray) -> Comparison:
    measured = Signals(TIME, {"q": reference(), "F": lacking}, {"q": "m", "F": "N"})
    simulated = Signals(TIME, {"q": reference(), "F": 0.0 * TIME}, {"q": "m", "F": "N"})
    return Comparison(role, role, None, measured, simulated, {})


def test_the_residual_is_told_by_role_with_what_laps_differ_by() -> None:
    wave = np.sin(2 * np.pi * TIME)
    drift = np.repeat([-0.1, 0.0, 0.1], TIME.size // 3)
    found = force_balance(
        SPEC, [comparison("fit", 2 * wave), comparison("validate", wave + drift)], [95.0, 95.0]
    )
    assert found is not None
    assert found.rms["fit"] == pytest.approx(math.sqrt(2.0), rel=0.02)  # 0.2 s of 6 s are left out
    assert found.rms["validate"] == pytest.approx(math.sqrt(0.5 + 0.02 / 3), rel=0.02)
    # The lap means of the second record are 0.1 N apart, the first one repeats exactly: mean of the variances.
    assert found.repeatability == pytest.approx(0.1 / math.sqrt(2.0), rel=0.05)
    assert (found.unit, found.band) == ("N", 20.0)


def test_without_laps_nothing_is_said_of_them_and_without_recordings_nothing_at_all() -> None:
    single = ForceSpec(position="q", force="F", mass="M", mass_at_start=95.0)
    found = force_balance(single, [comparison("fit", np.sin(2 * np.pi * TIME))], [95.0])
    assert found is not None
    assert math.isnan(found.repeatability)
    assert force_balance(SPEC, [], []) is None


def test_another_motion_has_no_laps_of_the_given_period() -> None:
    wave = np.sin(2 * np.pi * TIME)
    other = comparison("fit", wave)
    for signals in (other.measured, other.simulated):
        signals["q"][:] = 0.1 * np.sin(2 * np.pi * TIME / 1.3)
    found = force_balance(SPEC, [other], [95.0])
    assert found is not None
    assert math.isnan(found.repeatability)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            'position = "q"',
            'position = "x"',
            "force.position: 'x' is no measured output; add [recordings.columns.x].",
        ),
        ('mass = "M"', 'mass = "F_cc"', "force.mass: EMPS.fmu has no variable 'F_cc'. Did you mean 'F_c'?"),
        ("band = 20.0", "band = 0.0", "force.band: must be greater than 0, not 0.0."),
        ("band = 20.0", "bands = 20.0", "unknown key 'bands'"),
    ],
)
def test_what_the_force_residual_needs_is_checked(
    record: Path, tmp_path: Path, old: str, new: str, sentence: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        load(shortened(tmp_path, old=old, new=new), fit=[record])
    assert sentence in str(caught.value)


def test_the_shipped_scenario_asks_for_the_record() -> None:
    with pytest.raises(
        ScenarioError, match=r"recordings\.fit names no recording; add one, or give it with --fit"
    ):
        load(EMPS)
