"""The EMPS drive: the published recipe on the measured record, and the FMU against record and sampled controller."""

import json
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from reference.idim_ls import asymmetric_law, fit_force, symmetric_law
from scipy.interpolate import CubicSpline
from scipy.io import loadmat

from thsa_cosim.fmu import Plant
from thsa_cosim.inverse_dynamics import force_residual, low_pass, motion, repeatability
from thsa_cosim.signals import Signals

ROOT = Path(__file__).parents[2]
FMUS = [ROOT / "fmus" / "EMPS.fmu", ROOT / "fmus" / "fmi3" / "EMPS.fmu"]
DATA = ROOT.parent / "shared" / "emps" / "DATA_EMPS.mat"
needs_data = pytest.mark.skipif(
    not DATA.exists(), reason="DATA_EMPS.mat of nonlinearbenchmark.org is not here"
)

STEP, LAP, BAND = 1e-3, 6240, 20.0  # s, samples, Hz
PUBLISHED = {"M": 95.1089, "F_v": 203.5034, "F_c": 20.3935, "F_0": -3.1648}
ASYMMETRIC = {"M": 95.1540, "F_v+": 166.7061, "F_v-": 240.4236, "F_c+": 20.1440, "F_c-": 20.6277}
INNER = slice(100, -100)


@cache
def record() -> dict[str, np.ndarray]:
    return {name: value.ravel() for name, value in loadmat(DATA).items() if not name.startswith("__")}


def force() -> np.ndarray:
    return record()["gtau"] * record()["vir"]


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@needs_data
@pytest.mark.parametrize(
    ("law", "published", "error"),
    [(symmetric_law, PUBLISHED, 0.040834), (asymmetric_law, ASYMMETRIC, 0.031117)],
    ids=["symmetric", "asymmetric"],
)
def test_the_published_rows_come_out_to_every_digit(law, published, error) -> None:
    """Butterworth at 100 Hz, first 49 samples left out, decimation by ten: the script published with the data."""
    fit = fit_force(force(), law(motion(record()["qm"], STEP, 100.0)), samples=slice(49, None), factor=10)
    assert {name: round(value, 4) for name, value in fit.coefficients.items()} == published
    assert round(fit.relative_error, 6) == error


@needs_data
def test_most_of_the_residual_repeats_from_lap_to_lap() -> None:
    body = motion(record()["qm"], STEP, 5 * BAND)
    residuals = {}
    for law, published in ((symmetric_law, PUBLISHED), (asymmetric_law, ASYMMETRIC)):
        model = np.sum([published[name] * column for name, column in law(body).items()], axis=0)
        residuals[law] = low_pass(force() - model, BAND, STEP)[INNER]
    assert rms(residuals[symmetric_law]) == pytest.approx(1.913, abs=0.002)
    assert rms(residuals[asymmetric_law]) == pytest.approx(1.267, abs=0.005)
    assert repeatability(residuals[symmetric_law], LAP) == pytest.approx(0.27, abs=0.015)


@needs_data
def test_the_controller_is_known_to_the_quantisation() -> None:
    """What the model's two delays stand for: difference over two samples, no filter, no further delay."""
    q, reference = record()["qm"], record()["qg"]
    velocity = (q[2:] - q[:-2]) / (2 * STEP)
    law = record()["kv"] * (record()["kp"] * (reference - q)[2:] - velocity)
    assert rms(record()["vir"][2:] - law) < 0.004  # V; the voltage spans 8.6 V
    undelayed = record()["kv"] * (record()["kp"] * (reference - q)[1:-1] - velocity)
    assert rms(record()["vir"][1:-1] - undelayed) > 0.09


def sampled_loop(
    reference: np.ndarray, parameters: dict[str, float], parts: int = 20
) -> tuple[np.ndarray, ...]:
    """Position and motor force of the drive under its sampled controller, every sample: an independent simulation."""
    mass, viscous, coulomb, offset = (parameters[name] for name in ("M", "F_v", "F_c", "F_0"))
    x = before = last = float(reference[0])
    v, h, rows = 0.0, STEP / parts, []
    for target in reference.tolist():
        voltage = 243.45 * (160.18 * (target - x) - (x - last) / (2 * STEP))
        last, before = before, x
        push = 35.15065188248547 * voltage
        rows.append((x, push))
        for _ in range(parts):
            drive = push - offset - viscous * v
            if v == 0.0:
                rate = 0.0 if abs(drive) < coulomb else (drive - np.copysign(coulomb, drive)) / mass
            else:
                rate = (drive - np.copysign(coulomb, v)) / mass
            after = v + h * rate
            after = 0.0 if v * after < 0.0 else after
            x += h * (v + after) / 2
            v = after
    columns = np.array(rows)
    return columns[:, 0], columns[:, 1]


@pytest.mark.parametrize("fmu", FMUS, ids=["fmi2", "fmi3"])
def test_the_fmu_is_the_drive_under_its_sampled_controller(fmu: Path) -> None:
    time = np.arange(0.0, 3.0, STEP)
    reference = 0.03 * (1 - np.cos(2 * np.pi * time / 1.5))
    q, push = sampled_loop(reference, PUBLISHED)
    with Plant.open(fmu) as plant:
        drive = Signals(time, {"q_ref": reference, "F_load": 0.0 * time})
        found = plant.run(PUBLISHED, drive, ("q", "v", "vir", "F"), time)
    moving = slice(300, None)
    assert rms((found["q"] - q)[moving]) < 1e-7  # m; the loop lags by up to 0.8 mm
    assert (
        rms((found["F"] - push)[moving]) < 0.15
    )  # N; a stick longer or shorter by a sample at the reversals
    assert np.allclose(found["F"], 35.15065188248547 * found["vir"])
    assert rms((found["v"] - np.gradient(q, STEP))[moving]) < 2e-4


def test_an_external_force_deflects_the_loop_by_its_stiffness() -> None:
    time = np.arange(0.0, 1.0, STEP)
    load = np.where(time > 0.5, 60.0, 0.0)
    with Plant.open(FMUS[0]) as plant:
        run = plant.run(
            {"F_c": 0.0, "F_0": 0.0}, Signals(time, {"q_ref": 0.0 * time, "F_load": load}), ("q", "F"), time
        )
    assert run["F"][-1] == pytest.approx(60.0, rel=1e-4)
    assert run["q"][-1] == pytest.approx(-60.0 / (35.15065188 * 243.45 * 160.18), rel=1e-4)


@needs_data
def test_the_closed_loop_shows_the_same_force_residual_as_the_regressors() -> None:
    time, q = record()["t"], record()["qm"]
    measured = Signals(time, {"q": q, "F": force()}, {"q": "m", "F": "N"})
    with Plant.open(FMUS[0]) as plant:
        drive = Signals(time, {"q_ref": record()["qg"], "F_load": 0.0 * time})
        simulated = plant.run(PUBLISHED, drive, ("q", "F"), time)
    found = force_residual(measured, simulated, position="q", force="F", mass=PUBLISHED["M"], band=BAND)
    law = symmetric_law(motion(q, STEP, 5 * BAND))
    acting = CubicSpline(time, force())(np.maximum(time - STEP / 2, 0.0))  # held over the sample
    wanted = low_pass(acting - np.sum([PUBLISHED[n] * c for n, c in law.items()], axis=0), BAND, STEP)[INNER]
    settled = slice(300, 24500)
    assert rms((found["F"] - wanted[: len(found)])[settled]) < 0.15  # N
    assert rms(found["F"][settled]) == pytest.approx(1.95, abs=0.03)


@needs_data
@pytest.mark.slow
def test_identify_gives_the_published_parameters(tmp_path: Path) -> None:
    arguments = [
        "identify",
        str(ROOT / "scenarios" / "emps.toml"),
        "--fit",
        str(DATA),
        "-o",
        str(tmp_path / "study"),
    ]
    done = subprocess.run(
        [sys.executable, "-m", "thsa_cosim.cli", *arguments, "--workers", "2"],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "study" / "result.json").read_text())
    found = result["points"][0]["parameters"]
    for name, published in PUBLISHED.items():
        assert found[name]["identifiable"]
        assert abs(found[name]["value"] - published) < 2 * found[name]["stderr"], name
    assert found["M"]["stderr"] < 0.5
    errors = result["error"]
    assert errors["validate"]["F"]["rmse"] < 1.05 * errors["fit"]["F"]["rmse"] < 2.6


@needs_data
@pytest.mark.slow
def test_diagnose_finds_what_the_symmetric_model_lacks(tmp_path: Path) -> None:
    scenario, folder = str(ROOT / "scenarios" / "emps.toml"), tmp_path / "study"
    done = subprocess.run(
        [sys.executable, "-m", "thsa_cosim.cli", "diagnose", scenario, "--fit", str(DATA), "-o", str(folder)],
        capture_output=True,
        text=True,
        timeout=900,
    )
    assert done.returncode == 0, done.stderr
    result = json.loads((folder / "result.json").read_text())
    names = [effect["name"].split(":")[0] for effect in result["effects"]]
    assert names[0] == "asymmetric-friction"
    assert "stribeck" not in names
    slope = result["effects"][0]["parameters"]["db"]
    assert slope["value"] == pytest.approx((166.7061 - 240.4236) / 2, abs=4 * slope["stderr"])
    force = result["force_residual"]
    assert force["before"]["validate"] == pytest.approx(1.9, abs=0.1)  # N, lap 4
    assert force["after"]["validate"] <= 0.89
    assert [e["name"] for e in result["known"]] == ["spring:guide", "position-friction:guide"]
    assert force["repeatability"] == pytest.approx(0.27, abs=0.03)
    assert result["after"]["validate"]["F"]["rmse"] < 0.6 * result["before"]["validate"]["F"]["rmse"]
    # The extended model is an FMU that runs in closed loop over the whole record.
    record_time = record()["t"]
    with Plant.open(folder / result["fmu"]) as plant:
        drive = Signals(record_time, {"q_ref": record()["qg"], "F_load": 0.0 * record_time})
        simulated = plant.run({}, drive, ("q", "F"), record_time)
    settled = slice(300, None)
    assert rms((simulated["q"] - record()["qm"])[settled]) < 1e-4  # m
