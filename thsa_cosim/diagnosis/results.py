"""What a diagnosis found, as frozen data."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from thsa_cosim.identify import ForceBalance
from thsa_cosim.inspection import Inspection
from thsa_cosim.signals import Signals
from thsa_cosim.study import ChannelError, Comparison, CouplingError

Verdict = Literal["missing-effect", "no-missing-effect", "unexplained-structure", "not-tested"]


@dataclass(frozen=True)
class StructuredError(ChannelError):
    """A channel's error over some recordings, and the ``structure`` in it: rms, in its unit.

    ``significance``: the structure's square in standard deviations of what white noise would show.
    """

    structure: float
    significance: float


@dataclass(frozen=True)
class Value:
    """A fitted number in its unit, with one standard error (infinite: none).

    ``reason``: why the recordings do not determine it; "" if they do.
    """

    value: float
    unit: str
    stderr: float
    reason: str = ""
    variable: str = ""
    """The FMU variable that it belongs to, where a result says so."""
    role: str = "coefficient"
    """``"coefficient"`` or ``"shape"``, of an effect's parameter."""

    @property
    def identifiable(self) -> bool:
        """Whether the recordings determine it."""
        return not self.reason


@dataclass(frozen=True)
class KnownEffect:
    """An effect that the scenario declares, with its parameters as identified, those of the last model."""

    name: str
    parameters: Mapping[str, Value]


@dataclass(frozen=True)
class FoundEffect:
    """An effect that was added: its parameters, its equivalents in these recordings, and its probability."""

    name: str
    title: str
    parameters: Mapping[str, Value]
    equivalent: tuple[str, ...]
    probability: float
    order: str = ""
    """How often it repeats, and over the turn of which shaft; "" if over none."""


@dataclass(frozen=True)
class Judged:
    """A candidate that was weighed: ``held_out_gain`` in noise variances, ``decision`` and its ``reason``."""

    name: str
    variant: str
    fit_gain: float
    held_out_gain: float | None
    p_value: float
    parameters: Mapping[str, Value]
    decision: Literal["accepted", "rival", "rejected", "not refined", "not testable"]
    reason: str
    round: int


@dataclass(frozen=True)
class Balance:
    """An equation between measured signals: its residual and what the sensors' noise makes of it, in ``unit``."""

    equation: str
    unit: str
    rmse: float
    noise: float
    share: float
    at_fault: bool


@dataclass(frozen=True)
class Dependence:
    """Mean residual of a channel in a bin of a variable, before and after, in the channel's unit."""

    variable: str
    bin_centre: float
    unit: str
    channel: str
    channel_unit: str
    mean_before: float
    mean_after: float
    stderr: float


@dataclass(frozen=True)
class Evidence:
    """What a balance misses over its ``cause``, in bins (n,): measured with standard errors, and by both models.

    ``left`` is the signal on the balance's left side, whose ``unit`` the residual has; ``part`` the recordings;
    ``share`` of the residual's power that depends on the cause. ``before`` and ``after`` are NaN where there is none.
    """

    equation: str
    unit: str
    left: str
    part: str
    cause: str
    cause_unit: str
    share: float
    at: tuple[float, ...]
    measured: tuple[float, ...]
    stderr: tuple[float, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]


@dataclass(frozen=True)
class Sharpened:
    """The least certain value of an effect: its standard error, and what the experiment is expected to make of it."""

    variable: str
    before: float
    after: float

    @property
    def ratio(self) -> float:
        """Error after over error before."""
        return self.after / self.before


@dataclass(frozen=True)
class SeparatingExperiment:
    """The next experiment: ``inputs`` over time, and what is expected of it.

    ``rivals``: the accepted effect and what it is to be distinguished from; alone, ``sharpens`` says which of its
    values. ``distance`` of the nearest rival as fitted to the present recordings, ``present`` the same in these for as
    long a time, and ``expected``, what is left of the distance once the rival is fitted to the experiment as well: in
    noise variances. ``separates``: whether that is enough to decide. ``reached``: lowest and highest value of every
    output that the model expects.
    """

    name: str
    rivals: tuple[str, ...]
    distance: float
    present: float
    inputs: Signals
    expected: float = 0.0
    separates: bool = False
    reached: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    sharpens: Sharpened | None = None


@dataclass(frozen=True)
class EquivalenceClass:
    """Candidates that the recordings cannot distinguish, and the smallest principal angle between two of them."""

    names: tuple[str, ...]
    angle_deg: float


@dataclass(frozen=True)
class EmpiricalTerm:
    """A term of an empirical law in what a slot reads: v, z, N are speed, position and load, d the distance.

    ``shapes``: what is fitted inside the term, by name.
    """

    slot: str
    term: str
    coefficient: Value
    shapes: Mapping[str, Value] = field(default_factory=dict)


@dataclass(frozen=True)
class EmpiricalLaw:
    """An empirical law of the structure that no effect explains; ``held_out_gain`` in noise variances."""

    terms: tuple[EmpiricalTerm, ...]
    held_out_gain: float
    added: bool


@dataclass(frozen=True)
class RivalLaw:
    """A law that explains the held-out recordings as well as the effects do, or the law found, in place of them.

    ``declared``: the declared parameters with it.
    """

    terms: tuple[EmpiricalTerm, ...]
    declared: Mapping[str, Value]


Errors = Mapping[str, Mapping[str, StructuredError]]
"""Part ("fit", "validate") or recording → channel → error."""


@dataclass(frozen=True, eq=False)
class DiagnosisResult:
    """The verdict and all that led to it."""

    title: str
    status: Literal["complete", "interrupted"]
    seed: int
    version: str
    scenario: Path
    fmu: Path
    fmu_sha256: str
    verdict: Verdict
    effects: tuple[FoundEffect, ...]
    before: Errors
    after: Errors
    recordings_before: Errors
    """Recording → channel → error, of the declared model; ``recordings_after``: of the extended one, if any."""
    recordings_after: Errors
    declared_before: Mapping[str, Value]
    declared_after: Mapping[str, Value]
    unexplained: float
    model: Path | None
    extended_fmu: Path | None
    wrapper: Path | None
    """Of an FMU without source, in place of the two: the effects around it."""
    judged: tuple[Judged, ...]
    balances: tuple[Balance, ...]
    evidence: Evidence | None
    dependence: tuple[Dependence, ...]
    empirical: EmpiricalLaw | None
    equivalence: tuple[EquivalenceClass, ...]
    experiment: SeparatingExperiment | None
    comparisons_before: tuple[Comparison, ...]
    """Every recording beside the declared model; ``comparisons_after``: beside the extended one, if any."""
    comparisons_after: tuple[Comparison, ...]
    force_before: ForceBalance | None
    force_after: ForceBalance | None
    threshold: float
    evaluations: int
    failures: Mapping[str, int]
    notes: tuple[str, ...]
    data: Inspection = field(default_factory=Inspection)
    """What is to be known about the recordings."""
    asked: Mapping[str, Any] = field(default_factory=dict)
    """The scenario as it was asked for, in its tables: what the extended model is identified with again."""
    known: tuple[KnownEffect, ...] = ()
    """Effects of the declared model; their parameters stand among the declared ones by FMU variable, too."""
    coupling: CouplingError | None = None
    """What half the communication step changes at the last fit, of an FMU that depends on one."""
    instead: tuple[RivalLaw, ...] = ()
    """Laws that these recordings cannot tell from the effects, where the scenario asks for an empirical law."""
