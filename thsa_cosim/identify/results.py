"""What an identification returns: plain frozen objects, values in the parameters' own units."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from thsa_cosim.inspection import Inspection, Trust
from thsa_cosim.laws import Doubt, Law
from thsa_cosim.search import Generation, LocalSearch
from thsa_cosim.signals import FloatArray
from thsa_cosim.ssv import ParameterSet
from thsa_cosim.study import ChannelError, Comparison, CouplingError


@dataclass(frozen=True)
class Estimate:
    """One parameter at one point; ``stderr`` is None where none can be given.

    ``identifiable`` is False with a ``reason`` when the data do not determine the value.
    """

    value: float
    unit: str
    stderr: float | None
    identifiable: bool
    reason: str
    lower: float
    upper: float

    @property
    def on_bound(self) -> str:
        """``"lower"`` or ``"upper"`` where the value lies on that bound, else ""; a bound of 0 is a value as any."""
        near = 1e-6 * (self.upper - self.lower)
        if self.lower != 0.0 and self.value <= self.lower + min(near, 1e-3 * abs(self.lower)):
            return "lower"
        if self.upper != 0.0 and self.value >= self.upper - min(near, 1e-3 * abs(self.upper)):
            return "upper"
        return ""


@dataclass(frozen=True, eq=False)
class ProfileCurve:
    """Least cost (k,) over held ``values`` (k,) of a parameter, and the 95 % interval that it gives.

    ``lower`` and ``upper`` are None on a side on which the cost does not rise far enough.
    """

    values: FloatArray
    costs: FloatArray
    lower: float | None
    upper: float | None


@dataclass(frozen=True)
class ForceBalance:
    """Force residual below ``band`` Hz: its rms in ``unit`` by role, over all recordings of the role.

    ``repeatability``: standard deviation between laps, in ``unit``, which no law of the motion can undercut; NaN
    where no recording has two laps.
    """

    unit: str
    band: float
    rms: Mapping[str, float]
    repeatability: float


@dataclass(frozen=True)
class PointResult:
    """What was found at one temperature.

    ``cost``: equation 6 at the estimate, ``also`` the same with other error functions; ``cost_per_sample`` is 1
    when only the stated noise is left. ``correlation`` (n, n) follows the order of ``parameters``. ``converged``
    and ``stopped`` tell how the search ended, ``polished`` how the least-squares polish did (empty: none).
    ``local``: the local searches, if any; ``generations``: those of the evolution, if it ran.
    """

    label: str
    temperature_degC: float | None
    recordings: tuple[str, ...]
    parameters: Mapping[str, Estimate]
    correlation: FloatArray
    cost: float
    cost_per_sample: float
    terms: Mapping[str, float]
    also: Mapping[str, float]
    profiles: Mapping[str, ProfileCurve]
    generations: tuple[Generation, ...]
    evaluations: int
    converged: bool
    stopped: str
    polished: str
    local: tuple[LocalSearch, ...] = ()


@dataclass(frozen=True)
class LawResult:
    """A parameter's law over temperature, the candidates it was chosen from, and the published one."""

    parameter: str
    unit: str
    law: Law
    candidates: tuple[Law, ...]
    selected: bool
    published: Law | None
    deviation: float | None
    """Largest distance of the points from the published curve, relative to its largest value."""
    law_deviation: float | None
    """The same for the fitted law at the points' temperatures."""
    determined: bool = True
    """False if the data determine the parameter at none of the points: the law is then a fit to noise."""
    doubts: tuple[Doubt, ...] = ()
    """What the law does between the points' temperatures that its material does not."""
    published_doubts: tuple[Doubt, ...] = ()
    """The same of the published law."""
    between: tuple[float, float] | None = None
    """degC: the ends of the recorded temperatures, of a law that was searched as such."""


@dataclass(frozen=True)
class IdentifyResult:
    """An identification, complete or interrupted."""

    title: str
    status: str
    seed: int
    version: str
    fmu: Path
    fmu_sha256: str
    scenario: Path
    points: tuple[PointResult, ...]
    planned_points: int
    laws: Mapping[str, LawResult]
    comparisons: tuple[Comparison, ...]
    errors: Mapping[str, Mapping[str, ChannelError]]
    evaluations: int
    failures: Mapping[str, int]
    parameter_set: ParameterSet
    """The identified laws (or single values) as start values in the FMU's units."""
    notes: tuple[str, ...] = ()
    settings: Mapping[str, object] = field(default_factory=dict)
    force: ForceBalance | None = None
    data: Inspection = field(default_factory=Inspection)
    """What is to be known about the recordings."""
    trust: Trust = field(default_factory=lambda: Trust("explained"))
    """Whether the fit leaves nothing but noise."""
    coupling: CouplingError | None = None
    """What the steps of a system's components cost at the estimate; None where nothing is coupled by steps."""
