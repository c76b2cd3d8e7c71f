"""Drive, controller and stimuli of the FMI beginners' tutorial, coupled; FMI_TUTORIAL names the checkout."""

import os
from pathlib import Path

import numpy as np
import pytest

from system.test_coupled import run
from thsa_cosim.fmu import Plant
from thsa_cosim.signals import FloatArray
from thsa_cosim.system.assemble import Part, Wire

ROOT = Path(os.environ.get("FMI_TUTORIAL", "")) / "part3" / "tutorial_multiple_FMUs" / "fmus"
WIRES = (
    Wire("stimuli.w_desired", "control.w_desired"),
    Wire("stimuli.LoadTorque_Nm", "drive.LoadTorque_Nm"),
    Wire("drive.w", "control.w"),
    Wire("control.V", "drive.V"),
)
NAMES = ("stimuli", "control", "drive")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not ROOT.is_dir(), reason="FMI_TUTORIAL names no checkout of modelica/fmi-beginners-tutorial-2025"
    ),
]


def speed(folder: Path, step: float | None) -> FloatArray:
    execution = None if step is None else "coupled"
    parts = [Part(name, ROOT / f"{name.title()}.fmu", execution, step) for name in NAMES]
    return run(folder, parts, WIRES, ["drive.w"], values={}, tolerance=1e-6)["drive.w"]


def test_the_drive_reaches_its_speed_and_co_simulation_nears_model_exchange(tmp_path: Path) -> None:
    exact = speed(tmp_path, None)
    assert exact[-1] == pytest.approx(10.0, abs=1e-4)  # rad/s, what the stimuli ask for
    errors = [float(np.max(np.abs(speed(tmp_path, step) - exact)) / np.ptp(exact)) for step in (1e-3, 5e-4)]
    # The stimuli step: first order.
    assert errors[0] < 0.03
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.2)


def test_the_tutorials_own_single_fmu_nears_the_coupled_ones_as_its_step_falls(tmp_path: Path) -> None:
    """OpenModelica's Co-Simulation takes one Euler step for each communication step: first order, 5 % at 1 ms."""
    exact = speed(tmp_path, None)
    errors = []
    for steps in (1_000, 10_000):
        with Plant.open(ROOT / "MODELICA_Demo.ControlledElectricDrive.fmu") as plant:
            single = plant.run({}, None, ("w",), np.linspace(0.0, 1.0, steps + 1))["w"]
        errors.append(float(np.max(np.abs(single[:: steps // 100] - exact)) / np.ptp(exact)))
    assert errors[1] < 5e-3
    assert 8.0 < errors[0] / errors[1] < 16.0
