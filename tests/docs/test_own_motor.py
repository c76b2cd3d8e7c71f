"""The page on models of one's own: its motor has the slots that it promises, and its classes export and run."""

import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("casadi", reason="the export extra is not installed")

from thsa_cosim.diagnosis.catalogue.slots import find_slots
from thsa_cosim.export import causal_model, export_fmu
from thsa_cosim.export.flatten import flatten

ROOT = Path(__file__).parent.parent.parent
THSA = ROOT / "modelica" / "THSA"
LIBRARIES = [Path(p) for p in os.environ.get("MODELICAPATH", "").split(os.pathsep) if p]
WITHOUT_LIBRARY = pytest.mark.skipif(
    not any(list(p.glob("Modelica*/package.mo")) for p in LIBRARIES),
    reason="the Modelica Standard Library is not in MODELICAPATH",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The classes of the page, a file each."""
    made = tmp_path_factory.mktemp("own")
    page = (ROOT / "docs" / "howto" / "own-motor.md").read_text(encoding="utf-8")
    for name, text in re.findall(r"```modelica (\S+)\n(.*?)```", page, re.S):
        (made / name).write_text(text, encoding="utf-8")
    return made


def test_in_a_copy_of_the_package_the_motor_has_two_slots(folder: Path, tmp_path: Path) -> None:
    package = tmp_path / "THSA"
    shutil.copytree(THSA, package)
    source = (folder / "MyMotor.mo").read_text(encoding="utf-8")
    (package / "MyMotor.mo").write_text("within THSA;\n" + source, encoding="utf-8")
    assert causal_model("THSA.MyMotor", package).states == ("i", "w", "phi")
    slots = find_slots("THSA.MyMotor", package)
    assert [(s.name, s.interface) for s in slots] == [
        ("inverter", "VoltageEffect"),
        ("motor", "FrictionEffect"),
    ]


def test_an_effect_in_a_slot_takes_part(folder: Path) -> None:
    flat = flatten(str(folder / "MyMotorWithWindage.mo"), THSA)
    assert flat.variables["motorEffect.b_q"].binding == 1e-7
    assert causal_model(str(folder / "MyMotorWithWindage.mo"), THSA).states == ("i", "w", "phi")


@pytest.mark.slow
def test_steady_speed_with_and_without_the_effect(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("ziglang", reason="the export extra is not installed")
    import fmpy

    for name, b_q in (("MyMotor", 0.0), ("MyMotorWithWindage", 1e-7)):
        fmu = export_fmu(
            str(folder / f"{name}.mo"), package=THSA, output=tmp_path / f"{name}.fmu", platforms=["linux64"]
        )
        run = fmpy.simulate_fmu(str(fmu), stop_time=1.0, start_values={"u": 12.0}, output=["i", "w"])
        # K_t (u - K_t w)/R = T_c + b_q w^2
        speed = max(np.roots([b_q, 0.05**2 / 0.5, 5e-3 - 0.05 * 12 / 0.5]))
        assert run["w"][-1] == pytest.approx(speed, rel=1e-4)


@WITHOUT_LIBRARY
def test_the_drive_train_connects_to_the_standard_library(folder: Path) -> None:
    model = causal_model(str(folder / "LoadedActuator.mo"), THSA, LIBRARIES)
    assert {"motor.w_m", "surface.v", "stiffness.s_rel"} <= set(model.states)


@WITHOUT_LIBRARY
@pytest.mark.slow
def test_the_loaded_actuator_follows_its_command(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("ziglang", reason="the export extra is not installed")
    import fmpy

    fmu = export_fmu(
        str(folder / "LoadedActuator.mo"), package=THSA, libraries=LIBRARIES, output=tmp_path / "L.fmu",
        platforms=["linux64"],
    )  # fmt: skip
    run = fmpy.simulate_fmu(
        str(fmu), stop_time=1.0, output=["surface.v", "surface.s", "stiffness.f", "command.y"]
    )
    held = (run["time"] > 0.5) & (run["time"] < 0.6)
    assert run["surface.v"][held] == pytest.approx(run["command.y"][held], rel=0.05)
    travel = np.trapezoid(run["command.y"], run["time"])
    assert run["surface.s"][-1] == pytest.approx(travel, rel=0.05)
