"""The tables of a scenario of kind "tune": which keys there are, their types and ranges."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from thsa_cosim.scenario.metrics_schema import (
    ControlCostTable,
    LoopTable,
    MetricsTable,
    RequirementTable,
    StartTable,
)
from thsa_cosim.scenario.recording_schema import ColumnTable, TimeTable
from thsa_cosim.scenario.schema import EvolutionTable, SimulationTable
from thsa_cosim.scenario.system_schema import ModelTable
from thsa_cosim.scenario.table import Moderate, Name, NotNegative, Positive, StartValue, Table


class CommandTable(Table):
    """``[command]``: what the loop is told to do, and which output should follow."""

    input: Name
    """The FMU input that is commanded."""
    output: Name
    """The FMU output that should follow."""
    unit: str | None = None
    """Of ``final``, ``rate`` and ``points``; left out: the input's."""
    shape: Literal["ramp", "step", "points", "recorded"]
    """A ramp takes ``final`` and ``rate``, a step ``final``, ``"points"`` the ``points``; ``"recorded"`` is the column
    of ``[profile]``."""
    final: Moderate | None = None
    """Last value."""
    rate: Positive | None = None
    """Slope of a ramp, per s."""
    begin: NotNegative = 0.0
    """s, when a ramp or step begins."""
    points: list[list[float]] | None = None
    """Pairs ``[time in s, command]``, linear between them."""
    stop: Positive | None = None
    """s, the end. Of a recorded command: no later than this; left out: the recording's end."""
    step: Positive = 0.001
    """s, communication step; the sum in equation 7 runs over these samples."""

    @model_validator(mode="after")
    def _complete(self) -> "CommandTable":
        shapes: dict[str, set[str]] = {"ramp": {"final", "rate"}, "step": {"final"}, "points": {"points"}}
        wanted = shapes.get(self.shape, set())
        given = {key for key in ("final", "rate", "points") if getattr(self, key) is not None}
        if given != wanted:
            raise PydanticCustomError(
                "shape",
                "shape = '{shape}' takes {wanted} and nothing else of final, rate, points",
                {"shape": self.shape, "wanted": " and ".join(sorted(wanted)) or "none"},
            )
        if self.stop is None:
            if self.shape != "recorded":
                raise PydanticCustomError("stop", "stop is missing; only shape = 'recorded' ends by itself")
            return self
        if self.final == 0.0:
            raise PydanticCustomError("final", "final = 0 leaves nothing to rise to; use another number")
        if not 2 <= self.stop / self.step <= 1e7:
            raise PydanticCustomError("step", "step must divide stop into 2 to 10 million steps")
        if self.begin >= self.stop:
            raise PydanticCustomError("begin", "begin must lie before stop")
        return self

    @field_validator("points")
    @classmethod
    def _points(cls, points: list[list[float]] | None) -> list[list[float]] | None:
        if points is None:
            return None
        if len(points) < 2 or any(len(p) != 2 for p in points):
            raise PydanticCustomError("points", "must hold at least two pairs [time in s, command]")
        if any(not a[0] < b[0] for a, b in pairwise(points)):
            raise PydanticCustomError("points", "must run forward in time")
        if points[-1][1] == 0.0:
            raise PydanticCustomError("points", "must not end at 0: rise and error are relative to the end")
        return points


class ConditionTable(Table):
    """``[conditions.<variable>]``: what the loop must serve under.

    Values of FMU inputs or parameters, listed or as a range; all combinations are simulated for each set of gains.
    """

    values: list[Moderate] | None = Field(default=None, min_length=1, max_length=1000)
    """List of values; either this or all of ``from``, ``to``, ``step``."""
    from_: float | None = Field(default=None, alias="from")
    """First value."""
    to: float | None = None
    """Last value."""
    step: Positive | None = None
    """Between values."""
    unit: str | None = None
    """Left out: the FMU's."""
    weights: list[Positive] | None = None
    """One per value, with ``robust.combine = "sum"``."""

    @model_validator(mode="after")
    def _one_source(self) -> "ConditionTable":
        ends = (self.from_, self.to, self.step)
        if (self.values is None) == (None in ends) or (self.values is not None and ends != (None,) * 3):
            raise PydanticCustomError("source", "needs either 'values' or all of 'from', 'to' and 'step'")
        if self.from_ is not None and self.to is not None and self.step is not None:
            if not self.from_ < self.to:
                raise PydanticCustomError("order", "from must lie below to")
            if (self.to - self.from_) / self.step > 1000:
                raise PydanticCustomError("step", "step makes more than 1000 values; use a larger one")
        if self.values is not None and len(set(self.values)) < len(self.values):
            raise PydanticCustomError("values", "values repeat; list each once")
        if self.weights is not None and len(self.weights) != len(self.values or ()):
            raise PydanticCustomError("weights", "weights must be as many as values")
        return self


class ProfileTable(Table):
    """``[profile]``: recordings whose temperature, load or command drive every response, instead of constants.

    Each recording is one condition, combined with ``[conditions]``; the gains must serve all of them.
    """

    recordings: list[Name] = Field(min_length=1)
    """Files or globs."""
    time: TimeTable = TimeTable()
    columns: dict[Name, ColumnTable] = Field(min_length=1)
    """By FMU input."""


class GainTable(Table):
    """``[[parameters]]``: the gains, that is any parameters of the FMU."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]
    """Its name in results and in ``before`` and ``compare``."""
    variable: Name
    """The FMU parameter."""
    unit: str
    """Unit of bounds and result; converted to the FMU's."""
    lower: float
    """Lower bound."""
    upper: float
    """Upper bound."""
    scale: Literal["linear", "log"] = "log"
    """Scale of the search."""
    start: float | None = None
    """Takes the place of one vector of the first population."""
    description: str = ""
    """For tables; left out: the FMU's."""


class RobustTable(Table):
    """``[robust]``: how the conditions of one set of gains become one number."""

    combine: Literal["worst", "sum"] = "worst"
    """The worst of them, or their weighted sum."""


class UncertaintyTable(Table):
    """``[uncertainty]``: parameter samples from the covariance of an identification."""

    result: Name
    """Path of its ``result.json``."""
    samples: Annotated[int, Field(ge=1, le=1000)] = 8
    """How many."""
    temperature: Name | None = None
    """The condition that is the temperature."""
    variables: dict[Name, Name] = Field(min_length=1)
    """Parameter of the identification = FMU parameter."""


class ScheduleTable(Table):
    """``[schedule]``: gains for each value of one or two conditions, and the sweep that checks them."""

    over: list[Name] = Field(min_length=1, max_length=2)
    """One or two conditions."""
    smoothing: NotNegative = 1.0
    """Strength with which gains of neighbouring nodes are drawn together; lowered where limits would break.
    """
    reserve: Annotated[float, Field(ge=0, lt=1)] = 0.03
    """Share of the limits that the nodes' searches keep free for interpolation."""
    check: dict[Name, ConditionTable] = Field(default_factory=dict)


class ParetoTable(Table):
    """``[pareto]``: two terms of the evaluated gains that are set against each other."""

    x: str = "effort"
    """A term: tracking, rise_time, effort or another metric."""
    y: str = "tracking"
    """The other."""


class TuneSearchTable(EvolutionTable):
    """``[search]``: differential evolution, then a simplex from its best vector."""

    polish: bool = True
    """Nelder and Mead's simplex, which slides along the edges that requirements make. Without it the evolution runs
    alone, as in the article."""


class LineTable(Table):
    """``[line]``: the ratio of two parameters that the population draws towards."""

    numerator: Name
    """A parameter."""
    denominator: Name
    """Another."""
    generations: Annotated[int, Field(ge=1)] = 5
    """The last so many count."""
    published: float | None = None
    """A ratio to compare with."""


class SurfaceTable(Table):
    """``[surface]``: the cost over the plane of two parameters."""

    parameters: list[Name] = Field(min_length=2, max_length=2)
    """Two of them."""
    points: Annotated[int, Field(ge=3, le=200)] = 21
    """Along each."""


class TuneTable(ModelTable):
    """``kind = "tune"``: find gains for commands and conditions that the scenario describes itself."""

    kind: Literal["tune"]
    """``"tune"``."""
    title: str = ""
    """Shown in tables and plots."""
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 1
    """Of the search and of the parameter samples. ``--seed`` replaces it."""
    parameter_set: Name | None = None
    """Path of an SSV file with start values: the ``identified.ssv`` of a study."""
    fixed: dict[Name, StartValue] = Field(default_factory=dict)
    """Start values held in every run, by FMU variable, in the FMU's units; they win over ``parameter_set``. A String
    variable, be it a parameter or an input, gets a text in quotes, or the path of a file as ``{ file = "table.txt" }``.
    An enumeration gets the number of its item.
    """
    command: CommandTable
    conditions: dict[Name, ConditionTable] = Field(default_factory=dict)
    profile: ProfileTable | None = None
    parameters: list[GainTable] = Field(min_length=1)
    before: dict[Name, float] = Field(min_length=1)
    """A value of every parameter; the tuned values are compared with it."""
    compare: dict[Name, dict[Name, float]] = Field(default_factory=dict)
    """Further sets of values, by name: all of them, as in ``before``."""
    metrics: MetricsTable
    cost: ControlCostTable
    requirements: list[RequirementTable] = Field(default_factory=list)
    loop: LoopTable | None = None
    start: StartTable | None = None
    robust: RobustTable = RobustTable()
    uncertainty: UncertaintyTable | None = None
    schedule: ScheduleTable | None = None
    pareto: ParetoTable | None = None
    line: LineTable | None = None
    surface: SurfaceTable | None = None
    search: TuneSearchTable = TuneSearchTable()
    simulation: SimulationTable = SimulationTable()
