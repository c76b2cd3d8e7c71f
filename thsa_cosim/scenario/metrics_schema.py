"""The tables that say what a response of a tuning is judged by: metrics, cost, requirements, loop, start."""

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from thsa_cosim.costs.response import RESPONSE_METRICS
from thsa_cosim.scenario.table import Name, NotNegative, Positive, Share, Table

#: Metric → (unit, scale of an excess that counts as 1); the unit is empty where it follows from the scenario.
METRICS = {
    **RESPONSE_METRICS,
    "peak": ("", 1.0),
    "effort": ("", 1.0),
    "gain_margin": ("dB", 10.0),
    "phase_margin": ("deg", 10.0),
    "bandwidth": ("Hz", 10.0),
    "start_time": ("s", 0.1),
    "breakaway_current": ("", 1.0),
    "breakaway_margin": ("1", 0.1),
    "current_reserve": ("1", 0.1),
    "voltage_reserve": ("1", 0.1),
}
LOOP_METRICS = ("gain_margin", "phase_margin", "bandwidth")
START_METRICS = ("start_time", "breakaway_current", "breakaway_margin", "current_reserve", "voltage_reserve")
TERMS = ("tracking", *METRICS)


class MetricsTable(Table):
    """``[metrics]``: how rise time and steady-state error are read off a response."""

    rise: Literal["first-reach", "between"] = "first-reach"
    """From the start of the command to ``fraction``, or ``"between"`` ``low`` and ``high``."""
    fraction: Annotated[float, Field(gt=0, le=1)] = 0.95
    """Share of the final value whose first reach ends the rise."""
    low: Share = 0.1
    """Share at which a rise "between" begins."""
    high: Share = 0.9
    """Share at which it ends."""
    window: list[float]
    """``[from, to]`` in s, of the steady-state error."""
    settling_band: Annotated[float, Field(gt=0, lt=1)] = 0.02
    """Share of the final value within which the response has settled."""
    effort: Name | None = None
    """The signal whose root mean square is the effort."""

    @model_validator(mode="after")
    def _order(self) -> "MetricsTable":
        if not self.low < self.high:
            raise PydanticCustomError("order", "low must lie below high")
        if len(self.window) != 2 or not self.window[0] < self.window[1]:
            raise PydanticCustomError("window", "window must be [from, to] in s, from below to")
        return self


class ControlCostTable(Table):
    """``[cost]`` of a tuning: equation 7."""

    unit: str | None = None
    """Unit in which velocity errors count; left out: the command's."""
    kappa_rise: NotNegative
    """κ1, in 1/s."""
    kappa_steady: NotNegative
    """κ2."""
    steady: Literal["absolute", "signed"] = "absolute"
    """``"signed"`` takes e_ss as the article prints it, which rewards running too fast."""

    @property
    def signed(self) -> bool:
        """Whether the steady-state error counts with its sign."""
        return self.steady == "signed"


if TYPE_CHECKING:
    Metric = str
else:
    Metric = Literal[*METRICS]


class RequirementTable(Table):
    """``[[requirements]]``: limits on metrics."""

    metric: Metric
    """What is limited."""
    signal: Name | None = None
    """Of a ``peak``: whose."""
    unit: str | None = None
    """Of a ``peak``; left out: the signal's. The others have fixed units."""
    maximum: float | None = None
    """Upper limit; either this or ``minimum``."""
    minimum: float | None = None
    """Lower limit."""
    hard: bool = True
    """Gains beyond a hard limit are infeasible; beyond a soft one they cost ``penalty``."""
    penalty: Positive = 1.0
    """Of a soft limit, per ``scale`` of excess."""
    scale: Positive | None = None
    """What an excess is measured in; left out: the limit's size."""

    @property
    def upper(self) -> bool:
        """Whether the limit is a maximum."""
        return self.maximum is not None

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
    """``[loop]``: where the loop is opened for its margins.

    An FMU is linearised there. In a system that is coupled at run time, such as one with a sampled controller, the
    margins are measured: a multisine is added to a connection (``disturbance``), in two further runs for each response.
    """

    signal: Name
    """The controller's output; with ``disturbance`` the input that this is added to (the measured value)."""
    disturbance: Name | None = None
    """Input of the system that is added to ``signal`` (``disturbance`` of the connection)."""
    amplitude: Positive | None = None
    """Largest value of the disturbance, in the signal's unit: above its resolution, small enough to stay linear."""
    period: Positive = 1.0
    """s, of the disturbance: its inverse is the lowest frequency."""
    interval: Positive | None = None
    """s, between its values; left out: the sampling interval of the component that reads ``signal``."""
    at: NotNegative | None = None
    """s, at which state of the response; left out: at the end."""
    gains: list[Name] | None = Field(default=None, min_length=1)
    """Parameters that act through that signal alone; left out: all."""
    margins: Literal["own", "python-control"] = "own"
    """``"python-control"`` has python-control read gain and phase margin (extra ``control``)."""


class StartTable(Table):
    """``[start]``: the start from rest after a soak, against what the drive can give.

    It adds terms to every response: ``start_time`` (s from the start of the command until the output moves),
    ``breakaway_current`` (the current at that moment), ``breakaway_margin`` (``current_limit`` over that current,
    less one), ``current_reserve`` and ``voltage_reserve`` (1 − peak / limit). Breakaway current includes what
    accelerates the motor; a slow ramp gives the static one.
    """

    moving: Annotated[float, Field(gt=0, lt=1)] = 0.02
    """Share of its last value from which the output counts as moving."""
    current: Name
    """The motor's current."""
    current_limit: Positive
    """What the drive can give, in the signal's unit."""
    voltage: Name | None = None
    """The motor's voltage."""
    voltage_limit: Positive | None = None
    """What the drive can give, in the signal's unit."""

    @model_validator(mode="after")
    def _voltage(self) -> "StartTable":
        if (self.voltage is None) != (self.voltage_limit is None):
            raise PydanticCustomError("voltage", "voltage and voltage_limit go together; give both or none")
        return self

    @property
    def signals(self) -> tuple[str, ...]:
        """What it reads besides the command's output."""
        return tuple(name for name in (self.current, self.voltage) if name is not None)

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of its terms, in the order in which a response gives them."""
        return START_METRICS if self.voltage is not None else START_METRICS[:-1]
