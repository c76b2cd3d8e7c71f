"""The tables of a scenario file that only a diagnosis has: which keys there are, their types and ranges."""

from typing import Annotated

from pydantic import Field

from thsa_cosim.scenario.table import Name, Positive, Table


class BalanceTable(Table):
    """``[[diagnose.balances]]``: an equation between measured signals, whose residual says where an effect sits.

    Formulas of measured signals, inputs, numbers and ``[[parameters]]`` (as on the drawing), with ``+ - * / **``,
    ``der``, ``sgn``, ``abs``, ``max`` and ``min``. The terms' coefficients are fitted, so that wrong declared
    parameters do not show.
    """

    name: Name
    """Such as ``"electrical"``."""
    unit: str
    """Unit of the left side."""
    left: Name
    """Left side, such as ``"u_q"``."""
    terms: list[Name] = Field(min_length=1)
    """Right side, such as ``["i_q", "der(i_q)", "w_m"]``."""
    moving: Name | list[Name] = Field(default_factory=list)
    """Signals; samples where one is nearly zero are left out, since stiction leaves the balance open there."""
    band: Positive = 20.0
    """Hz; both sides are low-passed alike, without phase shift."""

    @property
    def moving_signals(self) -> tuple[str, ...]:
        """``moving`` as names, whether one or several were given."""
        return (self.moving,) if isinstance(self.moving, str) else tuple(self.moving)


class BlackBoxTable(Table):
    """``[diagnose.blackbox]``: what an FMU without source calls its signals; those that it lacks are left out.

    Effects then act through the load input, through the command, or on outputs.
    """

    speed: Name | None = None
    """Output: speed of the load, as its sensor reads it."""
    position: Name | None = None
    """Output: position of the load."""
    motor_speed: Name | None = None
    """Output: speed that the controller holds, as a rule that of the motor."""
    current: Name | None = None
    """Output: current of the motor."""
    voltage: Name | None = None
    """Output: voltage of the motor."""


class LimitsTable(Table):
    """``[diagnose.limits]``: what the rig can do, for the next experiment; what is left out is what was recorded."""

    time: Positive | None = None
    """Longest experiment in s; left out: as long as the longest fit recording, at most 12 s."""
    range: dict[Name, tuple[float, float]] = Field(default_factory=dict)
    """Lowest and highest value of an input or output (speed, current, position, load) by FMU variable, in its unit;
    left out: what was recorded, an output up to a fifth of its range more."""
    rate: dict[Name, Positive] = Field(default_factory=dict)
    """Largest change of the command or the load per s, by FMU variable, in its unit."""
    travel: Positive | None = None
    """Largest range of the command's integral, in its unit times s; left out: a fifth more than was recorded."""


class DiagnoseOptionsTable(Table):
    """``[diagnose]``: the model that effects are added to, and which are tried."""

    model: Name | None = None
    """Modelica class with effect slots, such as ``"THSA.Actuator"``, or the ``.mo`` file that holds it; left out: the
    FMU is a black box, and ``[diagnose.blackbox]`` names its signals."""
    package: Name | None = None
    """Folder of its package, relative to the scenario; left out: ``../modelica/THSA``, or the one that is shipped."""
    effects: list[Name] = Field(default_factory=list)
    """Names from the catalogue to try; none: all."""
    known: dict[Name, dict[Name, float]] = Field(default_factory=dict)
    """``[diagnose.known."spring:guide"]``: effects that the machine is known to have, with start values by parameter
    (in the FMU's units; left out: zero, and a shape's first start). They belong to the declared model and are fitted
    with its parameters."""
    catalogue: Name | None = None
    """A folder with effects of your own, one ``.py`` file each."""
    most: Annotated[int, Field(ge=1, le=10)] = 3
    """Largest number of effects that are added."""
    spread: Positive = 0.1
    """Relative standard deviation of a declared parameter about the drawing; ``parameters.spread`` wins over it."""
    command: Name | None = None
    """The input that commands the drive; a separating experiment may vary it."""
    load: Name | None = None
    """The input that loads the drive; a separating experiment may vary it."""
    empirical: bool = False
    """Add an empirical law to the model if a repeatable residual is left that no effect explains; else name the laws
    that explain as much as the effects."""
    limits: LimitsTable = LimitsTable()
    balances: list[BalanceTable] = Field(default_factory=list)
    blackbox: BlackBoxTable | None = None
