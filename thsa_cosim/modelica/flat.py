"""A flattened model: scalar variables, equations between terms, and what happens at events."""

from dataclasses import dataclass

from thsa_cosim.modelica.terms import Scalar, text


@dataclass(frozen=True)
class FlatVariable:
    """One scalar variable.

    ``variability`` is "continuous", "discrete", "parameter" or "constant"; ``causality`` is "input", "output" or
    "local" and counts at the top level only. ``type`` is "Real", "Integer" or "Boolean"; an enumeration is an Integer.
    Attributes are scalars over parameters, or None where they are not given. ``structural`` says that the value of a
    parameter was used to build the model and is fixed at export; ``tunable`` that one that is no Real can be set.
    """

    name: str
    type: str
    variability: str
    causality: str
    unit: str | None
    quantity: str | None
    description: str
    start: Scalar | None
    binding: Scalar | None
    minimum: Scalar | None
    maximum: Scalar | None
    nominal: Scalar | None
    fixed: bool | None
    final: bool
    state_select: str
    structural: bool
    place: str
    tunable: bool = False


@dataclass(frozen=True)
class FlatEquation:
    """``left = right`` at ``file:line``; ``event``: it stands in a when clause, and left is a variable."""

    left: Scalar
    right: Scalar
    place: str
    event: bool = False

    def __str__(self) -> str:
        return f"{text(self.left)} = {text(self.right)}"


@dataclass(frozen=True)
class Reinit:
    """The state gets the value when the condition becomes true."""

    state: str
    condition: Scalar
    value: Scalar
    place: str


@dataclass(frozen=True)
class Assertion:
    """A condition that has to hold; ``level`` is "error" or "warning"."""

    condition: Scalar
    message: str
    level: str
    place: str


@dataclass(frozen=True)
class Experiment:
    """The ``experiment`` annotation: times in s."""

    start: float = 0.0
    stop: float = 1.0
    tolerance: float = 1e-6
    interval: float = 1e-3


@dataclass(frozen=True)
class FlatModel:
    """A flattened Modelica class."""

    name: str
    description: str
    variables: dict[str, FlatVariable]
    equations: tuple[FlatEquation, ...]
    initial_equations: tuple[FlatEquation, ...]
    reinits: tuple[Reinit, ...]
    assertions: tuple[Assertion, ...]
    experiment: Experiment
    source_digest: str
