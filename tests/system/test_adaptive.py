"""Communication steps under error control: the coupled system against the same model as one FMU."""

from pathlib import Path

import numpy as np
import pytest
from fmu_sources import build

from thsa_cosim.errors import FmuError
from thsa_cosim.fmu import Plant
from thsa_cosim.fmu.description import DefaultExperiment
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.system import SystemPlant, read_description
from thsa_cosim.system.assemble import Part, Wire, assemble
from thsa_cosim.system.description import SystemDescription
from thsa_cosim.system.write import write_ssp

FMUS = Path(__file__).parents[2] / "fmus"
STEP = 2e-3
TIME = np.arange(0.0, 0.5001, STEP)
RAMP = Signals(
    TIME,
    {
        "v_cmd": np.clip(0.03 * TIME, 0.0, 0.009),
        "F_load": np.full_like(TIME, 55e3),
        "T_amb": np.full_like(TIME, -30.0),
    },
    {"v_cmd": "m/s", "F_load": "N", "T_amb": "degC"},
)
WIRES = [Wire("controller.i_ref", "plant.i_ref"), Wire("plant.w_m", "controller.w_m")]
SHOWN = {name: [f"plant.{name}"] for name in ("F_load", "T_amb", "i_q")} | {"v_cmd": ["controller.v_cmd"]}


def coupled(folder: Path, tolerance: float | None, **options: object) -> Path:
    parts = [
        Part(name, FMUS / f"{name.capitalize()}.fmu", "coupled", STEP, **options)  # type: ignore[arg-type]
        for name in ("controller", "plant")
    ]
    system, archives = assemble("THSA", parts, WIRES, SHOWN, tolerance)
    return write_ssp(system, archives, folder / f"{tolerance}.ssp", DefaultExperiment(0.0, 0.5))


def current(path: Path) -> FloatArray:
    with SystemPlant.open(path) as plant:
        return plant.run({}, RAMP, ["i_q"], TIME, tolerance=1e-8)["i_q"]


@pytest.fixture(scope="module")
def whole() -> FloatArray:
    with Plant.open(FMUS / "THSA.fmu") as plant:
        return plant.run({}, RAMP, ["i_q"], TIME, tolerance=1e-9)["i_q"]


def test_the_error_stays_below_the_tolerance_that_is_asked_for(tmp_path: Path, whole: FloatArray) -> None:
    def error(tolerance: float | None) -> float:
        return float(np.max(np.abs(current(coupled(tmp_path, tolerance)) - whole)) / np.max(np.abs(whole)))

    assert error(None) > 3e-3
    assert error(1e-2) < 2e-3
    assert error(1e-3) < 1e-3
    assert error(1e-4) < 1e-4


def test_the_tolerance_stands_in_the_archive(tmp_path: Path) -> None:
    description = read_description(coupled(tmp_path, 1e-3))
    assert isinstance(description, SystemDescription)
    assert description.system.coupling_tolerance == 1e-3


def test_components_in_separate_processes_are_put_back_too(tmp_path: Path) -> None:
    shared = current(coupled(tmp_path / "shared", 1e-2))
    assert np.array_equal(current(coupled(tmp_path / "own", 1e-2, process="own")), shared)


def test_what_cannot_be_put_back_is_refused_in_one_sentence() -> None:
    parts = [Part("a", build.lag2(), "coupled", 0.01)]
    with pytest.raises(FmuError, match=r"'a' cannot be put back to a former state \(canGetAndSetFMUstate\)"):
        assemble("s", parts, [], {}, 1e-3)
    with pytest.raises(FmuError, match="component 'plant' is continuous"):
        assemble("s", [Part("plant", FMUS / "Plant.fmu")], [], {}, 1e-3)
    ours = [Part("a", FMUS / "Plant.fmu", "coupled", 0.01), Part("b", FMUS / "Plant.fmu", "coupled", 0.02)]
    with pytest.raises(FmuError, match=r"steps by 0\.02 s, 'a' by 0\.01 s"):
        assemble("s", ours, [], {}, 1e-3)
