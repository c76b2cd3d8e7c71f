"""Lead screws that lock themselves, diagnosed from a model of a lossless screw."""

import json
from pathlib import Path
from typing import Any

import pytest

from thsa_cosim.cli import run_command

from .lead_screw_drive import Thread, record

MODEL = Path(__file__).with_name("LeadScrewDrive.mo")
SCENARIO = f"""
kind = "diagnose"
fmu = "drive.fmu"
seed = 1
[recordings]
fit = ["fit_1.csv", "fit_2.csv", "fit_3.csv"]
validate = ["validate_1.csv", "validate_2.csv"]
time = {{column = "time_s", unit = "s"}}
[recordings.columns]
w_ref = {{column = "speed_reference_rad_s", unit = "rad/s", interpolation = "hold"}}
m = {{column = "mass_kg", unit = "kg"}}
w = {{column = "speed_rad_s", unit = "rad/s"}}
i = {{column = "current_A", unit = "A"}}
[diagnose]
model = "{MODEL}"
most = 2
[simulation]
deadline = 20.0
"""
#: Name, unit, value and spread of the drawing, lower and upper bound.
PARAMETERS = (
    ("K_t", "N.m/A", 0.3, 0.05, 0.1, 1.0),
    ("J", "kg.m2", 4e-4, 0.3, 4e-5, 4e-3),
    ("T_c", "N.m", 0.05, 2.0, 0.0, 1.0),
    ("b", "N.m.s/rad", 5e-4, 2.0, 0.0, 0.02),
)
TRUE = {"K_t": 0.291, "J": 4.3e-4, "T_c": 0.06, "b": 6e-4}


def diagnosed(thread: Thread, masses: tuple[float, float, float], folder: Path) -> dict[str, Any]:
    """The result for recordings with a small and a large payload, held out those with one between them."""
    assert run_command(["export", str(MODEL), "-o", str(folder / "drive.fmu")]) == 0
    light, heavy, middle = masses
    runs = [("fit_1", light, "moves"), ("fit_2", heavy, "moves"), ("fit_3", heavy, "sines")]
    runs += [("validate_1", middle, "sines"), ("validate_2", middle, "moves")]
    for seed, (name, mass, kind) in enumerate(runs):
        record(thread, mass, kind, folder / f"{name}.csv", seed)
    tables = (
        f'[[parameters]]\nname = "{name}"\nvariable = "{name}"\nunit = "{unit}"\nstart = {start}\nspread = {spread}\n'
        f"lower = {low}\nupper = {high}\n"
        for name, unit, start, spread, low, high in PARAMETERS
    )
    (folder / "screw.toml").write_text(SCENARIO + "".join(tables))
    given = ["diagnose", str(folder / "screw.toml"), "-o", str(folder / "study"), "--workers", "1", "--quiet"]
    assert run_command(given) == 0
    return dict(json.loads((folder / "study" / "result.json").read_text()))


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("thread", "masses"),
    [
        (Thread(6.5, 0.12), (20.0, 200.0, 100.0)),
        (Thread(5.0, 0.15), (20.0, 200.0, 100.0)),
        (Thread(2.5, 0.4), (5.0, 30.0, 15.0)),
    ],
    ids=["barely", "steep", "flat"],
)
def test_the_thread_is_named_and_no_declared_parameter_is_wrong_and_sure(
    thread: Thread, masses: tuple[float, float, float], tmp_path: Path
) -> None:
    """The model's load on the nut is the weight alone, so that it leaves a little; that has to be said."""
    found = diagnosed(thread, masses, tmp_path)
    assert found["effects"][0]["name"] == "load-dependent-friction:screw"
    mu = found["effects"][0]["parameters"]["mu"]
    assert mu["value"] == pytest.approx(thread.mu, abs=3.0 * mu["stderr"])
    for name, true in TRUE.items():
        own = found["parameters"]["after"][name]
        sure = own["identifiable"] and found["trust"]["verdict"] == "explained"
        assert not sure or own["value"] == pytest.approx(true, abs=3.0 * own["stderr"])
    assert found["after"]["validate"]["i"]["rmse"] < 0.15 * found["before"]["validate"]["i"]["rmse"]
