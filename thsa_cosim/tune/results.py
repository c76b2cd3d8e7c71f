"""What a tuning returns: plain frozen objects, gains in the parameters' own units."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from thsa_cosim.scenario import TuneScenario
from thsa_cosim.search import Generation
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study import CouplingError
from thsa_cosim.tune.population import Line
from thsa_cosim.tune.schedule import GainSchedule


@dataclass(frozen=True, eq=False)
class Scored:
    """One set of gains under the conditions of a group.

    ``terms`` (c, q) per case, in the order of the result's ``terms``; ``worst`` (q,) of them; ``eq7`` is
    equation 7 combined over the conditions, ``cost`` the same with requirements; ``excess`` per requirement.
    """

    name: str
    gains: Mapping[str, float]
    cost: float
    eq7: float
    worst: Mapping[str, float]
    terms: FloatArray
    excess: Mapping[str, float]
    feasible: bool
    signals: tuple[Signals | None, ...] = ()


@dataclass(frozen=True, eq=False)
class GroupResult:
    """What was found for one group of conditions; ``at`` is its node in the schedule."""

    label: str
    at: Mapping[str, float]
    gains: Mapping[str, float]
    cost: float
    feasible: bool
    generations: tuple[Generation, ...]
    stopped: str


@dataclass(frozen=True, eq=False)
class Surface:
    """Cost (k, k) over the plane of two parameters: ``x`` (k,) along columns, ``y`` (k,) along rows.

    Infeasible points hold NaN in ``cost``; ``populations`` are the search's (S, 2), by generation.
    """

    names: tuple[str, str]
    x: FloatArray
    y: FloatArray
    cost: FloatArray
    eq7: FloatArray
    populations: tuple[FloatArray, ...]


@dataclass(frozen=True, eq=False)
class Pareto:
    """Non-dominated feasible gains: ``values`` (k, n) with their ``x`` and ``y`` (k,)."""

    x_name: str
    y_name: str
    x: FloatArray
    y: FloatArray
    values: FloatArray
    all_x: FloatArray
    all_y: FloatArray


@dataclass(frozen=True, eq=False)
class ScheduleCheck:
    """The sweep between the nodes: ``conditions`` label each row of the sets' ``terms``."""

    conditions: tuple[Mapping[str, float], ...]
    sets: tuple[Scored, ...]


@dataclass(frozen=True, eq=False)
class ScheduleResult:
    """The smoothed schedule, the nodes' own optima, the smoothing that was used, and its check."""

    schedule: GainSchedule
    unsmoothed: GainSchedule
    smoothing: float
    check: ScheduleCheck | None


@dataclass(frozen=True, eq=False)
class TuneResult:
    """A tuning, complete or interrupted; ``after`` is None when nothing was found."""

    scenario: TuneScenario
    status: str
    version: str
    fmu: Path
    groups: tuple[GroupResult, ...]
    terms: tuple[str, ...]
    conditions: tuple[Mapping[str, float], ...]
    before: Scored | None
    after: Scored | None
    compare: tuple[Scored, ...]
    line: Line | None
    surface: Surface | None
    pareto: Pareto | None
    schedule: ScheduleResult | None
    evaluations: int
    failures: Mapping[str, int]
    notes: tuple[str, ...] = ()
    settings: Mapping[str, object] = field(default_factory=dict)
    coupling: CouplingError | None = None
    """What half the communication step changes with the tuned gains, of an FMU that depends on one."""
