"""The tables of a scenario of kind "tune": which keys there are, their types and ranges."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from thsa_cosim.scenario.schema import Moderate, Name, NotNegative, Positive, Share, SimulationTable, Table
from thsa_cosim.search.strategies import Strategy


class CommandTable(Table):
    """``[command]``: what the loop is told to do, and which output should follow."""

    input: Name
    output: Name
    unit: str | None = None
    shape: Literal["ramp", "step", "points"]
    final: Moderate | None = None
    rate: Positive | None = None
    begin: NotNegative = 0.0
    points: list[list[float]] | None = None
    stop: Positive
    step: Positive = 0.001

    @model_validator(mode="after")
    def _complete(self) -> "CommandTable":
        wanted = {"ramp": {"final", "rate"}, "step": {"final"}, "points": {"points"}}[self.shape]
        given = {key for key in ("final", "rate", "points") if getattr(self, key) is not None}
        if given != wanted:
            raise PydanticCustomError(
                "shape",
                "shape = '{shape}' takes {wanted} and nothing else of final, rate, points",
                {"shape": self.shape, "wanted": " and ".join(sorted(wanted))},
            )
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
    """``[conditions.<FMU input or parameter>]``: what the loop must serve under, listed or as a range."""

    values: list[Moderate] | None = Field(default=None, min_length=1, max_length=1000)
    from_: float | None = Field(default=None, alias="from")
    to: float | None = None
    step: Positive | None = None
    unit: str | None = None
    weights: list[Positive] | None = None

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


class GainTable(Table):
    """``[[parameters]]``: a gain, that is any parameter of the FMU."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]
    variable: Name
    unit: str
    lower: float
    upper: float
    scale: Literal["linear", "log"] = "log"
    start: float | None = None
    description: str = ""


class MetricsTable(Table):
    """``[metrics]``: how rise time and steady-state error are read off a response."""

    rise: Literal["first-reach", "between"] = "first-reach"
    fraction: Annotated[float, Field(gt=0, le=1)] = 0.95
    low: Share = 0.1
    high: Share = 0.9
    window: list[float]
    settling_band: Annotated[float, Field(gt=0, lt=1)] = 0.02
    effort: Name | None = None

    @model_validator(mode="after")
    def _order(self) -> "MetricsTable":
        if not self.low < self.high:
            raise PydanticCustomError("order", "low must lie below high")
        if len(self.window) != 2 or not self.window[0] < self.window[1]:
            raise PydanticCustomError("window", "window must be [from, to] in s, from below to")
        return self


class ControlCostTable(Table):
    """``[cost]`` (eq. 7)."""

    unit: str | None = None
    kappa_rise: NotNegative
    kappa_steady: NotNegative
    steady: Literal["absolute", "signed"] = "absolute"


Metric = Literal[
    "rise_time", "steady_state_error", "overshoot", "settling_time", "tracking_error", "peak", "effort",
    "gain_margin", "phase_margin", "bandwidth",
]  # fmt: skip


class RequirementTable(Table):
    """``[[requirements]]``: a limit on a metric, hard (infeasible beyond) or soft (a penalty)."""

    metric: Metric
    signal: Name | None = None
    unit: str | None = None
    maximum: float | None = None
    minimum: float | None = None
    hard: bool = True
    penalty: Positive = 1.0
    scale: Positive | None = None

    @model_validator(mode="after")
    def _complete(self) -> "RequirementTable":
        if (self.maximum is None) == (self.minimum is None):
            raise PydanticCustomError("limit", "needs either 'maximum' or 'minimum'")
        if (self.metric == "peak") != (self.signal is not None):
            raise PydanticCustomError("signal", "'signal' goes with metric = 'peak', and only with it")
        if self.unit is not None and self.metric != "peak":
            raise PydanticCustomError("unit", "'unit' goes with metric = 'peak'; the others have fixed units")
        if self.hard and "penalty" in self.model_fields_set:
            raise PydanticCustomError("penalty", "'penalty' goes with hard = false")
        return self


class LoopTable(Table):
    """``[loop]``: where the velocity loop is opened for its margins, and at which time of the response."""

    signal: Name
    at: NotNegative | None = None
    gains: list[Name] | None = Field(default=None, min_length=1)
    margins: Literal["own", "python-control"] = "own"


class RobustTable(Table):
    """``[robust]``: how the conditions of one set of gains become one number."""

    combine: Literal["worst", "sum"] = "worst"


class UncertaintyTable(Table):
    """``[uncertainty]``: parameter samples from the covariance of an identification."""

    result: Name
    samples: Annotated[int, Field(ge=1, le=1000)] = 8
    temperature: Name | None = None
    variables: dict[Name, Name] = Field(min_length=1)


class ScheduleTable(Table):
    """``[schedule]``: gains for each value of one or two conditions, and the sweep that checks them."""

    over: list[Name] = Field(min_length=1, max_length=2)
    smoothing: NotNegative = 1.0
    reserve: Annotated[float, Field(ge=0, lt=1)] = 0.03
    check: dict[Name, ConditionTable] = Field(default_factory=dict)


class ParetoTable(Table):
    """``[pareto]``: two terms of the evaluated gains that are set against each other."""

    x: str = "effort"
    y: str = "tracking"


class LineTable(Table):
    """``[line]``: the ratio of two parameters that the population draws towards."""

    numerator: Name
    denominator: Name
    generations: Annotated[int, Field(ge=1)] = 5
    published: float | None = None


class SurfaceTable(Table):
    """``[surface]``: the cost over the plane of two parameters, ``points`` along each."""

    parameters: list[Name] = Field(min_length=2, max_length=2)
    points: Annotated[int, Field(ge=3, le=200)] = 21


class TuneSearchTable(Table):
    """``[search]``: the article's setting by default."""

    population: Annotated[int, Field(ge=5, le=100_000)] = 45
    generations: Annotated[int, Field(ge=1, le=1_000_000)] = 30
    mutation: Annotated[float, Field(gt=0, lt=2)] = 0.16
    crossover: Share = 0.5
    strategy: Strategy = "rand1bin"
    tolerance: NotNegative = 1e-3


class TuneTable(Table):
    """``kind = "tune"``: find gains for commands and conditions that the scenario describes itself."""

    kind: Literal["tune"]
    title: str = ""
    fmu: Name
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 1
    parameter_set: Name | None = None
    fixed: dict[Name, float | bool] = Field(default_factory=dict)
    command: CommandTable
    conditions: dict[Name, ConditionTable] = Field(default_factory=dict)
    parameters: list[GainTable] = Field(min_length=1)
    before: dict[Name, float] = Field(min_length=1)
    compare: dict[Name, dict[Name, float]] = Field(default_factory=dict)
    metrics: MetricsTable
    cost: ControlCostTable
    requirements: list[RequirementTable] = Field(default_factory=list)
    loop: LoopTable | None = None
    robust: RobustTable = RobustTable()
    uncertainty: UncertaintyTable | None = None
    schedule: ScheduleTable | None = None
    pareto: ParetoTable | None = None
    line: LineTable | None = None
    surface: SurfaceTable | None = None
    search: TuneSearchTable = TuneSearchTable()
    simulation: SimulationTable = SimulationTable()
