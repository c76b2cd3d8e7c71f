"""What half the communication step changes at the values that a study has found."""

from dataclasses import replace

import numpy as np
import pytest
from fmu_sources.build import habits2, lag2

from thsa_cosim.batch import Experiment
from thsa_cosim.fmu import Plant, read_description
from thsa_cosim.scenario import SimulationTable
from thsa_cosim.signals import Signals
from thsa_cosim.study import CouplingError, coupling_error

TIME = np.linspace(0.0, 1.0, 101)
STEP = Signals(TIME, {"u": np.ones(TIME.size)})
TAU = 0.2


def euler(parts: int) -> np.ndarray:
    """The lag's answer to a unit step by explicit Euler, 10 ms in so many parts."""
    return 1.0 - (1.0 - 0.01 / parts / TAU) ** (parts * np.arange(101))


@pytest.mark.parametrize("exchange", [False, True])
@pytest.mark.parametrize("noise", [1.0, 1e-4])
def test_the_error_of_a_foreign_fmus_step_is_told_next_to_the_noise(noise: float, exchange: bool) -> None:
    fmu = habits2("EULER")
    with Plant.open(fmu) as plant:
        simulated = plant.run({"tau": TAU}, STEP, ["y"], TIME)
    experiment = Experiment("fit/step", fmu, STEP, ("y",), TIME, {})
    described = replace(read_description(fmu), supports_model_exchange=exchange)
    found = coupling_error(described, SimulationTable(), experiment, {"tau": TAU}, simulated, {"y": noise})
    assert isinstance(found, CouplingError)
    change = float(np.sqrt(np.mean((euler(2) - euler(1)) ** 2)))
    assert found.changes["y"] == pytest.approx(change, rel=1e-9)
    remedy = "; lower simulation.step" + ', or set simulation.interface = "model-exchange"' * exchange
    assert found.reason == "" if noise == 1.0 else found.reason.endswith(remedy)
    assert found.recording == "step"


def test_without_a_sensor_the_range_counts() -> None:
    found = CouplingError(
        "ramp", {"w": 0.3, "zero": 0.2}, {}, {"w": "rad/s", "zero": "1"}, ranges={"w": 10.0}
    )
    assert found.worst == ("w", pytest.approx(0.03))
    assert "0.3 rad/s rms, 3 % of its range (ramp)" in found.reason
    assert found.note == f"WARNING: {found.reason}"
    small = CouplingError("ramp", {"w": 0.05}, {}, {"w": "rad/s"}, ranges={"w": 10.0})
    assert (small.reason, small.note) == ("", small.sentence())


@pytest.mark.parametrize(
    "fmu", [lambda: lag2("EULER"), lambda: habits2("EULER", flags=""), lambda: lag2(tool="vendor")]
)
def test_what_depends_on_no_step_is_not_run_again(fmu: object) -> None:
    """FMUs of this toolkit, those of one step size, and Model Exchange."""
    path = fmu()  # type: ignore[operator]
    spec = SimulationTable(
        interface="model-exchange" if "vendor" in path.name or "foreign" in path.name else None
    )
    experiment = Experiment("step", path, STEP, ("y",), TIME, {})
    simulated = Signals(TIME, {"y": TIME})
    assert coupling_error(read_description(path), spec, experiment, {}, simulated, {"y": 1.0}) == ""
