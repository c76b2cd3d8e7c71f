"""What a tuning scenario is once it is read: frozen objects in the FMU's units."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Literal

from thsa_cosim.fmu import FmuDescription
from thsa_cosim.inspection import Inspection, inspect
from thsa_cosim.parameters import ParameterSpace
from thsa_cosim.recordings import Recording
from thsa_cosim.scenario.metrics_schema import (
    ControlCostTable,
    LoopTable,
    MetricsTable,
    RequirementTable,
    StartTable,
)
from thsa_cosim.scenario.schema import SearchTable, SimulationTable
from thsa_cosim.scenario.table import start_texts
from thsa_cosim.scenario.tune_schema import (
    LineTable,
    ParetoTable,
    ScheduleTable,
    SurfaceTable,
    TuneTable,
    UncertaintyTable,
)
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.units import convert


@dataclass(frozen=True, eq=False)
class CommandSpec:
    """The command: ``time`` (n,) in s and ``values`` (n,) in the input's unit; it starts to move at ``begin``.

    ``output`` should follow; ``factor`` turns its unit into that of the input.
    """

    input: str
    output: str
    unit: str
    time: FloatArray
    values: FloatArray
    begin: float
    factor: float
    ends_at_most: bool = True
    """Whether the last value is the largest: a recorded profile that goes on has no rise, overshoot or settling."""


PROFILE = "profile"
"""The axis whose values are the numbers of the recorded profiles."""


@dataclass(frozen=True, eq=False)
class Profile:
    """A recording that drives responses: ``inputs`` of the FMU in its units, without the command; its ``command``."""

    recording: Recording
    inputs: Signals
    command: CommandSpec


@dataclass(frozen=True)
class Axis:
    """One condition's values in ``unit`` (as in the scenario) with their weights; the FMU's unit may differ.

    ``is_input``: an input of the FMU that stays constant, else a parameter. The axis :data:`PROFILE` is neither: it
    numbers the recorded profiles from 1.
    """

    name: str
    unit: str
    fmu_unit: str
    values: tuple[float, ...]
    weights: tuple[float, ...]
    is_input: bool

    def to_fmu(self, value: float) -> float:
        """Return ``value`` [unit] in the FMU input's unit."""
        return convert(value, self.unit, self.fmu_unit) if self.unit != self.fmu_unit else value


@dataclass(frozen=True)
class Condition:
    """What stays constant: ``shown`` in the scenario's units, ``inputs`` and ``values`` (parameters) in the FMU's."""

    shown: Mapping[str, float]
    inputs: Mapping[str, float]
    values: Mapping[str, float]
    weight: float

    @property
    def label(self) -> str:
        """Short name, such as ``T_amb=-30 F_load=55``; empty for no condition."""
        return " ".join(f"{name}={value:.10g}" for name, value in self.shown.items())


def combinations(axes: Sequence[Axis]) -> tuple[Condition, ...]:
    """Every combination of the axes' values, the last axis running fastest; weights multiply."""
    conditions = []
    for picks in product(*(range(len(axis.values)) for axis in axes)):
        shown = {a.name: a.values[k] for a, k in zip(axes, picks, strict=True)}
        weight = 1.0
        for axis, k in zip(axes, picks, strict=True):
            weight *= axis.weights[k]
        inputs = {a.name: a.to_fmu(shown[a.name]) for a in axes if a.is_input}
        values = {a.name: a.to_fmu(shown[a.name]) for a in axes if not a.is_input and a.name != PROFILE}
        conditions.append(Condition(shown, inputs, values, weight))
    return tuple(conditions)


class ControlCostSpec(ControlCostTable):
    """``[cost]`` with its unit; velocity errors are divided by ``scale`` (one ``unit`` in the command input's unit)."""

    unit: str
    scale: float


class Requirement(RequirementTable):
    """One of ``[[requirements]]`` with its ``limit`` in ``unit``; ``scale`` is the excess that counts as 1."""

    unit: str
    scale: float
    limit: float

    @property
    def name(self) -> str:
        """``overshoot`` or, for the peak of a signal, ``peak.i_q``."""
        return self.metric if self.signal is None else f"{self.metric}.{self.signal}"

    def tightened(self, reserve: float) -> "Requirement":
        """Return the same with its limit moved inwards by a share of its size."""
        moved = self.limit - (reserve if self.upper else -reserve) * abs(self.limit)
        return self.model_copy(update={"limit": moved})


class LoopSpec(LoopTable):
    """``[loop]`` with its defaults: linearised with the response's state ``at`` [s].

    ``gains`` are FMU parameters that act on the plant through the signal alone.
    """

    at: float
    gains: tuple[str, ...]  # type: ignore[assignment]


@dataclass(frozen=True, eq=False)
class CovariancePoint:
    """An identification's standard errors (n,), in its units, and correlation (n, n) at one temperature."""

    temperature_degC: float | None
    stderr: FloatArray
    correlation: FloatArray


class UncertaintySpec(UncertaintyTable):
    """``[uncertainty]`` with what was read; ``factors`` turn the unit of each of ``variables`` into the FMU's."""

    factors: tuple[float, ...]
    points: tuple[CovariancePoint, ...]


class ScheduleSpec(ScheduleTable):
    """``[schedule]``, whose ``check`` holds the axes of the sweep."""

    check: tuple[Axis, ...]  # type: ignore[assignment]


@dataclass(frozen=True, eq=False)
class TuneScenario:
    """What to tune, and for what.

    ``before`` and ``compare`` hold values of all parameters in the parameters' units; they may lie outside the
    bounds. ``fixed`` are FMU start values (FMU units). ``table`` is the file as it was written, checked, with its
    defaults.
    """

    path: Path
    table: TuneTable
    title: str
    seed: int
    fmu: FmuDescription
    fixed: Mapping[str, float]
    command: CommandSpec
    axes: tuple[Axis, ...]
    parameters: ParameterSpace
    before: Mapping[str, float]
    compare: Mapping[str, Mapping[str, float]]
    metrics: MetricsTable
    cost: ControlCostSpec
    requirements: tuple[Requirement, ...]
    loop: LoopSpec | None
    start: StartTable | None
    combine: Literal["worst", "sum"]
    uncertainty: UncertaintySpec | None
    schedule: ScheduleSpec | None
    pareto: ParetoTable | None
    line: LineTable | None
    surface: SurfaceTable | None
    search: SearchTable
    simulation: SimulationTable
    profiles: tuple[Profile, ...] = ()
    kind: str = "tune"

    @property
    def texts(self) -> Mapping[str, str]:
        """Start values of the FMU's String parameters and inputs, of every run."""
        return start_texts(self.path.parent, self.table.fixed)

    @cached_property
    def data(self) -> Inspection:
        """What an inspection finds in the recorded profiles."""
        recordings = [profile.recording for profile in self.profiles]
        found = inspect(recordings, [name for r in recordings for name in r.signals.names])
        # A profile of temperature is meant to move, and begins where the command does.
        meant = ("temperature-drift", "moving-start")
        return replace(found, findings=tuple(f for f in found.findings if f.kind not in meant))

    def profile_of(self, shown: Mapping[str, float]) -> Profile | None:
        """The recorded profile of a condition's ``shown`` values, if it has one."""
        return self.profiles[int(shown[PROFILE]) - 1] if PROFILE in shown else None

    def command_of(self, shown: Mapping[str, float]) -> CommandSpec:
        """The command under a condition: the profile's, or the scenario's."""
        profile = self.profile_of(shown)
        return self.command if profile is None else profile.command
