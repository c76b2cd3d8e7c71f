"""Components in this process and in processes of their own: the same results, and each is named when it fails."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmu_sources import build

from system.test_coupled import RING, TIME, VALUES, ring, run
from thsa_cosim.batch import Experiment, Job, LocalRunner, Status
from thsa_cosim.fmu import SimulationFailure
from thsa_cosim.fmu.description import DefaultExperiment
from thsa_cosim.system import SystemPlant, read_description
from thsa_cosim.system.assemble import Part, Wire, assemble
from thsa_cosim.system.description import SystemDescription
from thsa_cosim.system.member import crowded, own_processes
from thsa_cosim.system.plant import unpack
from thsa_cosim.system.write import write_ssp


def system(folder: Path, parts: list[Part], wires: tuple[Wire, ...] = RING) -> Path:
    made, archives = assemble("ring", parts, wires, {})
    return write_ssp(made, archives, folder / "ring.ssp", DefaultExperiment(0.0, 1.0))


@pytest.mark.parametrize("execution", ["continuous", "coupled", "sampled"])
def test_a_process_of_its_own_changes_no_bit(tmp_path: Path, execution: Any) -> None:
    step = None if execution == "continuous" else 0.01
    found = []
    for process in ("shared", "own"):
        parts = [Part("fast", build.lag2()), Part("slow", build.lag3(), execution, step, process=process)]  # type: ignore[arg-type]
        found.append(run(tmp_path, parts, RING, ["fast.y", "slow.y"], tolerance=1e-6))
    assert np.array_equal(found[0]["slow.y"], found[1]["slow.y"])
    assert np.array_equal(found[0]["fast.y"], found[1]["fast.y"])
    if execution == "continuous":
        assert np.max(np.abs(found[1]["slow.y"] - ring(TIME)[:, 1])) < 1e-4


def lags(*defines: str, flags: str = 'canHandleVariableCommunicationStepSize="true"') -> list[Part]:
    fmu = build.habits2(*defines, flags=flags)
    return [Part(name, fmu, "coupled", 0.01, start={"gain": 0.5}) for name in ("fast", "slow")]


def test_an_fmu_that_is_refused_beside_another_gets_a_process_of_its_own(tmp_path: Path) -> None:
    values = {"fast.tau": 0.05, "slow.tau": 0.2}
    plain = run(tmp_path, lags(), RING, ["slow.y"], values=values)
    path = system(tmp_path, lags("ALONE"))
    with SystemPlant.open(path) as plant:
        for _ in range(2):
            assert np.array_equal(plant.run(values, None, ["slow.y"], TIME)["slow.y"], plain["slow.y"])


def test_an_fmu_that_allows_one_instance_per_process_gets_one_for_each(tmp_path: Path) -> None:
    flags = 'canHandleVariableCommunicationStepSize="true" canBeInstantiatedOnlyOncePerProcess="true"'
    parts = lags("ALONE", flags=flags)
    description = read_description(system(tmp_path, parts))
    assert isinstance(description, SystemDescription)
    assert own_processes(description.system) == {
        "slow": f"{parts[1].fmu.name} allows one instance per process"
    }


def test_libraries_of_the_same_name_in_two_archives_are_kept_apart(tmp_path: Path) -> None:
    fmus = []
    for name in ("one", "two"):
        fmu = tmp_path / f"{name}.fmu"
        fmu.write_bytes(build.lag2().read_bytes())
        with zipfile.ZipFile(fmu, "a") as archive:
            archive.writestr("binaries/linux64/libcommon.so", name)
            archive.writestr(f"binaries/linux64/lib{name}.so", name)
        fmus.append(fmu)
    path = system(tmp_path, [Part("fast", fmus[0]), Part("slow", fmus[1])])
    description = read_description(path)
    assert isinstance(description, SystemDescription)
    assert crowded(description.system, unpack(path, tmp_path / "unpacked")) == {"slow"}


def test_start_values_that_a_tool_overwrites_at_its_set_up_are_set_again(tmp_path: Path) -> None:
    """20-sim does; once for those of the archive, once for those of the run."""
    values = {"fast.tau": 0.05, "slow.tau": 0.2}
    plain = run(tmp_path, lags(), RING, ["slow.y"], values=values)
    forgetful = run(tmp_path, lags("SETUP_FORGETS"), RING, ["slow.y"], values=values)
    assert np.array_equal(plain["slow.y"], forgetful["slow.y"])


FAULTY = [
    ("segfault", "shared", Status.CRASH, "the process died by SIGSEGV while stepping at t = 0.5"),
    ("segfault", "own", Status.CRASH, "component slow: its process died by SIGSEGV"),
    ("hang", "shared", Status.TIMEOUT, "while stepping at t = 0.5"),
    ("hang", "own", Status.TIMEOUT, "while stepping at t = 0.5"),
    ("error", "own", Status.FMI_ERROR, "component slow: fmi2DoStep"),
]


@pytest.mark.parametrize(("fault", "process", "status", "sentence"), FAULTY)
def test_the_component_that_crashes_or_hangs_is_named(
    tmp_path: Path, fault: str, process: Any, status: Status, sentence: str
) -> None:
    parts = [
        Part("fast", build.lag2(), "coupled", 0.01),
        Part("slow", build.lag2(), "coupled", 0.01, process=process),
    ]
    experiment = Experiment("ring", system(tmp_path, parts), None, ("slow.y",), TIME)
    values = {**VALUES, "slow.fault": float(build.FAULTS[fault])}
    deadline = 3.0 if status is Status.TIMEOUT else 60.0
    with LocalRunner([experiment], workers=1, deadline_s=deadline) as runner:
        failed, fine = runner.run([Job("ring", values), Job("ring", VALUES)])
    assert failed.status is status
    assert sentence in failed.reason
    assert "component slow" in failed.reason
    assert fine.ok


def test_a_failure_in_this_process_names_the_component_too(tmp_path: Path) -> None:
    parts = [Part("fast", build.lag2(), "coupled", 0.01), Part("slow", build.lag2(), "coupled", 0.01)]
    with (
        SystemPlant.open(system(tmp_path, parts)) as plant,
        pytest.raises(SimulationFailure, match=r"^component slow: fmi2EnterInit"),
    ):
        plant.run({"slow.fault": float(build.FAULTS["init_error"])}, None, ["slow.y"], TIME)
