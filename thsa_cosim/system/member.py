"""The instance of one component: in this process, or in a separate process where it cannot share one.

Either notes in the run's progress that it is at work, so that whoever finds the process dead or hanging can name it.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from thsa_cosim.fmu.apart import ApartInstance
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.failure import SimulationFailure
from thsa_cosim.fmu.fmi2 import Fmi2Instance
from thsa_cosim.fmu.fmi3 import Fmi3Instance
from thsa_cosim.fmu.instance import Instance
from thsa_cosim.fmu.native import LIBRARY_SUFFIX, MessageSink, platform_folders
from thsa_cosim.signals import FloatArray
from thsa_cosim.system.structure import Component, System

AT_WORK = 3
"""Place in a run's progress of the number of the component that is at work, from 1; 0 for none."""


class _Marked:
    """Notes when the FMU is called, and names the component in what fails."""

    name: str
    number: int
    mark: FloatArray

    def call(self, *arguments: Any, **options: Any) -> None:
        self.mark[AT_WORK] = self.number
        super().call(*arguments, **options)  # type: ignore[misc]
        self.mark[AT_WORK] = 0.0

    def access(self, *arguments: Any) -> int:
        self.mark[AT_WORK] = self.number
        code: int = super().access(*arguments)  # type: ignore[misc]
        self.mark[AT_WORK] = 0.0
        return code

    def instantiate(self) -> None:
        self.mark[AT_WORK] = self.number
        super().instantiate()  # type: ignore[misc]
        self.mark[AT_WORK] = 0.0

    def free(self) -> None:
        self.mark[AT_WORK] = self.number
        super().free()  # type: ignore[misc]
        self.mark[AT_WORK] = 0.0

    def ask(self, *arguments: Any) -> Any:
        self.mark[AT_WORK] = self.number
        with named(self.name):
            result = super().ask(*arguments)  # type: ignore[misc]
        self.mark[AT_WORK] = 0.0
        return result

    def check(self, *arguments: Any, **options: Any) -> None:
        with named(self.name):
            super().check(*arguments, **options)  # type: ignore[misc]


class _Fmi2(_Marked, Fmi2Instance):
    pass


class _Fmi3(_Marked, Fmi3Instance):
    pass


class _Apart(_Marked, ApartInstance):
    pass


def member(
    component: Component,
    number: int,
    folder: Path,
    mark: FloatArray,
    *,
    apart: bool,
    sink: MessageSink | None = None,
) -> Instance:
    """Load a component's FMU, unpacked in ``folder``; ``mark`` is the run's progress, ``number`` counts from 1."""
    cls = _Apart if apart else _Fmi2 if component.fmu.fmi_version == "2.0" else _Fmi3
    how = "model-exchange" if component.execution == "continuous" else "co-simulation"
    mark[AT_WORK] = number
    with named(component.name):
        found = cls(folder, component.fmu, how, sink)
    mark[AT_WORK] = 0.0
    found.name, found.number, found.mark = component.name, number, mark
    return found


def own_processes(system: System) -> Mapping[str, str]:
    """Components that run in a process of their own, with the reason, as far as the descriptions say."""
    found: dict[str, str] = {}
    here: set[str] = set()
    for component in system.components:
        fmu = component.fmu
        if component.process == "own":
            found[component.name] = "as asked"
        elif fmu.sha256 in here and fmu.capabilities.get("canBeInstantiatedOnlyOncePerProcess"):
            found[component.name] = f"{fmu.path.name} allows one instance per process"
        else:
            here.add(fmu.sha256)
    return found


def crowded(system: System, folder: Path) -> set[str]:
    """Components whose archive brings a library of the same name as an earlier one's: only one would be loaded."""
    found: set[str] = set()
    here: set[str] = set()
    for component in system.components:
        own = _neighbours(folder / "components" / component.name, component.fmu)
        if own & here:
            found.add(component.name)
        else:
            here |= own
    return found


def _neighbours(folder: Path, fmu: FmuDescription) -> set[str]:
    """Names of the libraries next to the FMU's own."""
    own = {f"{i}{LIBRARY_SUFFIX}" for i in (fmu.co_simulation_identifier, fmu.model_exchange_identifier)}
    places = (folder / "binaries" / name for name in platform_folders(fmu.fmi_version))
    files = (p.name for place in places if place.is_dir() for p in place.iterdir())
    return {name for name in files if LIBRARY_SUFFIX in name} - own


class named:
    """Put the component's name before what a failure says."""

    def __init__(self, name: str) -> None:
        self._prefix = f"component {name}: "

    def __enter__(self) -> None: ...

    def __exit__(self, _kind: Any, error: BaseException | None, _trace: Any) -> None:
        if isinstance(error, SimulationFailure) and not error.reason.startswith(self._prefix):
            raise SimulationFailure(error.status, self._prefix + error.reason) from error
