"""Plant and controller compiled into one FMU: the whole actuator, to rounding."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from fmu_sources import build

from thsa_cosim.export.merge import NotMergeable, merge
from thsa_cosim.fmu import Plant
from thsa_cosim.fmu.description import DefaultExperiment
from thsa_cosim.signals import Signals
from thsa_cosim.system import read_description
from thsa_cosim.system.assemble import Part, Wire, assemble
from thsa_cosim.system.description import SystemDescription
from thsa_cosim.system.write import write_ssp

FMUS = Path(__file__).parents[2] / "fmus"
PARTS = (
    Part("controller", FMUS / "Controller.fmu", start={"velocityController.K_p": 0.363}),
    Part("plant", FMUS / "Plant.fmu"),
)
WIRES = (Wire("controller.i_ref", "plant.i_ref"), Wire("plant.w_m", "controller.w_m"))
CONNECTORS = {
    "v_cmd": ["controller.v_cmd"],
    "F_load": ["plant.F_load"],
    "T_amb": ["plant.T_amb"],
    "v": ["plant.v"],
    "command": ["controller.i_ref"],
}
TIME = np.arange(0.0, 1.2005, 1e-3)
KNOTS = np.array([0.0, 0.1, 0.4, 1.3])
RAMP = Signals(
    KNOTS,
    {"v_cmd": np.array([0.0, 0.0, 9e-3, 9e-3]), "F_load": np.full(4, 55e3), "T_amb": np.full(4, -30.0)},
    {"v_cmd": "m/s", "F_load": "N", "T_amb": "degC"},
)


def merged(folder: Path, parts: Sequence[Part] = PARTS, wires: Sequence[Wire] = WIRES) -> Path:
    connectors = CONNECTORS if parts is PARTS else {}
    system, archives = assemble("THSA", parts, wires, connectors)
    path = write_ssp(system, archives, folder / "THSA.ssp", DefaultExperiment(0.0, 1.2))
    description = read_description(path)
    assert isinstance(description, SystemDescription)
    return merge(description, archives, folder / "merged")


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("ziglang")
    return merged(tmp_path_factory.mktemp("merge"))


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_it_is_the_whole_actuator(fmu: Path, kind: str) -> None:
    names = {"v": "v", "plant.w_m": "w_m", "plant.i_q": "i_q", "plant.x": "x"}
    gain = {"velocityController.K_p": 0.363, "velocityController.K_i": 2.98}
    with Plant.open(FMUS / "THSA.fmu", kind=kind) as plant:  # type: ignore[arg-type]
        whole = plant.run(gain, RAMP, list(names.values()), TIME, tolerance=1e-8)
    with Plant.open(fmu, kind=kind) as plant:  # type: ignore[arg-type]
        outputs = [*names, "command", "plant.i_ref", "controller.i_ref"]
        values = {"controller.velocityController.K_i": 2.98}  # K_p is the component's own start value
        found = plant.run(values, RAMP, outputs, TIME, tolerance=1e-8)
    for ours, theirs in names.items():
        assert np.max(np.abs(found[ours] - whole[theirs])) < 1e-7 * np.ptp(whole[theirs]), ours
    assert np.array_equal(found["plant.i_ref"], found["controller.i_ref"])
    assert np.array_equal(found["command"], found["controller.i_ref"])


def test_its_description_is_valid(fmu: Path) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(fmu)) == []
    description = read_description(fmu)
    assert {v.name for v in description.inputs} == {"v_cmd", "F_load", "T_amb"}
    assert description.variables["plant.i_ref"].causality == "local"
    assert description.variables["controller.velocityController.K_p"].start == 0.363
    assert description.states == 8


def test_its_jacobian_is_exact(fmu: Path) -> None:
    """The chain through the connections against central differences of the derivatives."""
    from thsa_cosim.fmu.fmi2 import Fmi2Instance
    from thsa_cosim.fmu.scratch import ScratchFolder
    from thsa_cosim.system import unpack

    description = read_description(fmu)
    scratch = ScratchFolder()
    try:
        unpack(fmu, scratch.path / "fmu")
        instance = Fmi2Instance(scratch.path / "fmu", description, "model-exchange")
        instance.instantiate()
        instance.initialize_begin(0.0, 1.0, None)
        instance.initialize_end()
        instance.event_iteration()
        instance.enter_continuous_time_mode()
        inputs = instance.channels([description.variable("v_cmd")])
        point = instance.point(inputs)
        x = np.array([0.1, 0.02, 3.0, 20.0, 5.0, 1e-3, 4e-3, 3e-3])
        exact, n = np.empty((len(x), len(x))), len(x)
        point.place(0.0, x, np.array([5e-3]))
        instance.jacobian(exact)
        differences = np.empty((n, n))
        for k in range(n):
            step = 1e-6 * max(abs(x[k]), 1e-3)
            ends = []
            for sign in (1.0, -1.0):
                moved = x.copy()
                moved[k] += sign * step
                point.place(0.0, moved, np.array([5e-3]))
                ends.append(point.derivatives(0.0).copy())
            differences[:, k] = (ends[0] - ends[1]) / (2.0 * step)
        instance.free()
    finally:
        scratch.remove()
    scale = np.max(np.abs(exact), axis=1, keepdims=True)
    assert np.max(np.abs(exact - differences) / scale) < 1e-6
    # The loop is closed: the controller's integral sees the motor's speed, the current the controller's integral.
    assert np.count_nonzero(exact[0]) >= 1
    assert np.count_nonzero(exact[:, 0]) >= 1


def test_gains_between_components_count(tmp_path: Path) -> None:
    """Twice the current reference is the same as twice the gains."""
    pytest.importorskip("ziglang")
    wires = (Wire("controller.i_ref", "plant.i_ref", 2.0), Wire("plant.w_m", "controller.w_m"))
    path = merged(
        tmp_path, [Part("controller", FMUS / "Controller.fmu"), Part("plant", FMUS / "Plant.fmu")], wires
    )
    inputs = Signals(
        KNOTS,
        {"controller.v_cmd": RAMP["v_cmd"], "plant.F_load": RAMP["F_load"], "plant.T_amb": RAMP["T_amb"]},
        {"controller.v_cmd": "m/s", "plant.F_load": "N", "plant.T_amb": "degC"},
    )
    with Plant.open(path) as plant:
        found = plant.run({}, inputs, ["plant.v"], TIME, tolerance=1e-8)["plant.v"]
    with Plant.open(FMUS / "THSA.fmu") as plant:
        gains = {"velocityController.K_p": 0.24, "velocityController.K_i": 0.9}
        whole = plant.run(gains, RAMP, ["v"], TIME, tolerance=1e-8)["v"]
    assert np.max(np.abs(found - whole)) < 1e-7 * np.ptp(whole)


def test_what_cannot_be_merged_says_why(tmp_path: Path) -> None:
    lag = build.lag2()
    loop = (Wire("a.feed", "b.u"), Wire("b.feed", "a.u"))
    cases: list[tuple[Sequence[Part], Sequence[Wire], str]] = [
        ([PARTS[0], Part("plant", FMUS / "Plant.fmu", "coupled", 1e-3)], WIRES, "plant is coupled"),
        ([Part("a", lag)], (), "a carries no sources"),
        ([Part("a", build.lag3())], (), "a is no FMI 2.0 FMU of this exporter"),
        ([Part("a", lag), Part("b", lag)], loop, "it has an algebraic loop"),
    ]
    for parts, wires, reason in cases:
        with pytest.raises(NotMergeable, match=reason):
            merged(tmp_path, parts, wires)
