"""What a scenario is once it is read: frozen objects with every file loaded and every unit the FMU's."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from statistics import median

from thsa_cosim.errors import ScenarioError
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.inspection import Inspection, inspect
from thsa_cosim.parameters import ParameterSpace
from thsa_cosim.recordings import Recording
from thsa_cosim.scenario.diagnose_schema import BlackBoxTable, DiagnoseOptionsTable
from thsa_cosim.scenario.schema import (
    CommonTable,
    CostTable,
    ForceTable,
    LawTable,
    SearchTable,
    SimulationTable,
)
from thsa_cosim.scenario.table import Name, start_texts
from thsa_cosim.signals import Signals
from thsa_cosim.system.description import SystemDescription


class ForceSpec(ForceTable):
    """``[force]`` with the ``mass_at_start``: the parameter's value in the FMU, in its unit."""

    mass_at_start: float


class BlackBoxSpec(BlackBoxTable):
    """``[diagnose.blackbox]`` with the inputs ``command`` and ``load`` of ``[diagnose]``. None: no such signal."""

    command: Name | None = None
    load: Name | None = None


class DiagnoseSpec(DiagnoseOptionsTable):
    """``[diagnose]`` with its folders found, and how far each parameter may be off the drawing.

    ``spreads``: relative standard deviation by parameter name.
    """

    package: Path  # type: ignore[assignment]
    catalogue: Path | None  # type: ignore[assignment]
    spreads: Mapping[str, float]
    blackbox: BlackBoxSpec | None = None
    """Of an FMU without source: ``model`` is None then."""


@dataclass(frozen=True, eq=False)
class TemperaturePoint:
    """Recordings that are identified together, with one set of parameters.

    ``temperature_degC`` is their rounded mean, None for a joint fit over all temperatures. ``fixed`` are FMU
    start values (FMU units) of every run; ``space`` what is searched.
    """

    temperature_degC: float | None
    fit: tuple[Recording, ...]
    validate: tuple[Recording, ...]
    fixed: Mapping[str, float]
    space: ParameterSpace

    @property
    def label(self) -> str:
        """Short name, such as ``-30.0 degC`` or ``all``."""
        return "all" if self.temperature_degC is None else f"{self.temperature_degC:.6g} degC"


@dataclass(frozen=True, eq=False)
class Scenario:
    """What to run and what to compare it with.

    ``points`` groups the fit recordings (and the validate recordings of the same temperature); ``validate``
    holds every recording that no fit may touch. ``inputs`` drive the FMU, ``measured`` are the outputs that the
    recordings hold, ``outputs`` those to be simulated. ``fixed`` are FMU start values (FMU units). ``table`` is the
    file as it was written, checked, with its defaults.
    """

    kind: str
    path: Path
    table: CommonTable
    title: str
    seed: int
    fmu: FmuDescription
    fit: tuple[Recording, ...]
    validate: tuple[Recording, ...]
    points: tuple[TemperaturePoint, ...]
    inputs: tuple[str, ...]
    measured: tuple[str, ...]
    outputs: tuple[str, ...]
    fixed: Mapping[str, float]
    parameters: ParameterSpace
    laws: Mapping[str, LawTable]
    cost: CostTable
    search: SearchTable
    simulation: SimulationTable
    round_to: float = 1.0
    zeroed: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """FMU parameters that are 0 because of a parameter's ``zero`` or ``law_block``, by its name."""
    force: ForceSpec | None = None
    diagnose: DiagnoseSpec | None = None
    """Of a diagnosis only."""

    @cached_property
    def data(self) -> Inspection:
        """What an inspection finds in the recordings."""
        found = inspect((*self.fit, *self.validate), self.inputs)
        if not self.parameters.combinations:
            return found
        # a temperature that moves is what laws are searched by
        kept = (f for f in found.findings if f.kind != "temperature-drift")
        return Inspection.of(tuple(kept), found.repairs)

    @property
    def texts(self) -> Mapping[str, str]:
        """Start values of the FMU's String parameters and inputs, of every run."""
        return start_texts(self.path.parent, self.table.fixed)

    @property
    def file_units(self) -> Mapping[str, str | None]:
        """Unit of each signal's numbers in the files, as the scenario gives it; None: as the file states it."""
        return {name: column.unit for name, column in self.table.recordings.columns.items()}

    @property
    def notes(self) -> tuple[str, ...]:
        """What the readers of the system and of the recordings have to say."""
        read = self.fmu.system.notes if isinstance(self.fmu, SystemDescription) else ()
        return (*read, *(note for recording in (*self.fit, *self.validate) for note in recording.notes))

    def drive(self, recording: Recording) -> Signals:
        """Return the FMU's inputs of a recording."""
        return recording.signals.select(self.inputs)

    def noise(self, recording: Recording, channel: str) -> float:
        """Return a channel's noise (FMU unit, above 0): the scenario's, else the sensor's.

        One sensor has one noise: the median of what the fit recordings show, or of the recording itself without any.
        """
        spec = self.cost.channels.get(channel)
        own = recording.noise[channel]
        seen = [r.noise[channel] for r in self.fit if r.noise.get(channel, 0.0) > 0.0]
        given = None if spec is None else spec.given_noise
        noise = median(seen or [own]) if given is None else given
        if not noise > 0 or not math.isfinite(noise):
            raise ScenarioError(
                f"{self.path}: no noise can be seen on {channel!r} in {recording.path};"
                f" give it as cost.channels.{channel}.noise."
            )
        return noise

    def fixed_for(self, recording: str) -> Mapping[str, float]:
        """Return the FMU start values (FMU units) of every run of a recording, by its name."""
        own = (p.fixed for p in self.points if any(r.name == recording for r in (*p.fit, *p.validate)))
        return next(own, self.fixed)

    def given(self, by_temperature: Mapping[float | None, Mapping[str, float]]) -> "Scenario":
        """Return the scenario with further FMU start values per temperature point (what an earlier stage found).

        A variable that is searched for stays searched for.
        """
        points = tuple(
            replace(p, fixed={**p.fixed, **_without(by_temperature.get(p.temperature_degC, {}), p.space)})
            for p in self.points
        )
        return replace(self, points=points)


def _without(values: Mapping[str, float], space: ParameterSpace) -> dict[str, float]:
    searched = {p.variable for p in space.parameters}
    return {name: value for name, value in values.items() if name not in searched}
