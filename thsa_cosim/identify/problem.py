"""What is to be identified at a point, cut loose from files: recordings, channels, parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.batch import Experiment, Job, Outcome
from thsa_cosim.costs.channels import ResidualReducer, TermsReducer
from thsa_cosim.costs.identification import error_terms
from thsa_cosim.parameters import ParameterSpace
from thsa_cosim.scenario import Scenario, SearchTable, TemperaturePoint
from thsa_cosim.search import LocalSettings
from thsa_cosim.signals import FloatArray
from thsa_cosim.study import Case, Want, build_case, stacked


@dataclass(frozen=True, eq=False)
class Given:
    """Start values that an earlier stage found, and how sure they are.

    ``values``: FMU variable → value in its unit; ``covariance`` (m, m) in the same order and units.
    """

    values: Mapping[str, float]
    covariance: FloatArray

    @property
    def stderr(self) -> FloatArray:
        """One standard error of each value (m,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


@dataclass(frozen=True, eq=False)
class PointProblem:
    """The recordings at one temperature (or all of them) and the parameters they share.

    ``error`` is the f of equation 6 that is minimised, ``also`` those that are also reported.
    """

    label: str
    temperature_degC: float | None
    cases: tuple[Case, ...]
    space: ParameterSpace
    error: str
    also: tuple[str, ...] = ()
    given: Given | None = None
    profile: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.space.names

    @property
    def size(self) -> int:
        """Number of recordings."""
        return len(self.cases)

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names of the fitted signals, in order."""
        return tuple(channel.name for channel in self.cases[0].channels)

    @property
    def samples(self) -> int:
        """Number of residuals N."""
        return sum(channel.measured.size for case in self.cases for channel in case.channels)

    @property
    def groups(self) -> Sequence[Sequence[slice]]:
        """Per recording the slices of its channels in the stacked residuals."""
        groups, position = [], 0
        for case in self.cases:
            slices = []
            for channel in case.channels:
                slices.append(slice(position, position + channel.measured.size))
                position += channel.measured.size
            groups.append(slices)
        return groups

    @property
    def experiments(self) -> list[Experiment]:
        """Per recording the simulation that returns its cost terms, and the one that returns its residuals."""
        made = []
        for case in self.cases:
            made += [
                case.experiment(_name(case, Want.TERMS), TermsReducer(case.channels, self.error)),
                case.experiment(_name(case, Want.RESIDUALS), ResidualReducer(case.channels)),
            ]
        return made

    def decode(self, vectors: FloatArray) -> FloatArray:
        """Vectors (..., n) of the unit cube in the parameters' units."""
        return self.space.physical(vectors)

    def jobs(
        self, want: Want, values: Sequence[Mapping[str, float]], overrides: Mapping[str, float]
    ) -> list[Job]:
        """One simulation per recording."""
        return [
            Job(
                _name(case, want),
                {**self.space.assignments(own, case.name), **overrides},
                keep_signals=want is Want.SIGNALS,
            )
            for case, own in zip(self.cases, values, strict=True)
        ]

    def judge(self, want: Want, outcomes: Sequence[Outcome]) -> tuple[float, FloatArray]:
        """Cost and its terms per channel (c,) over all recordings; infinite if one failed."""
        if want is Want.TERMS and all(o.ok for o in outcomes):
            terms = np.sum([o.reduced for o in outcomes if o.reduced is not None], axis=0)
        elif want is Want.RESIDUALS and (residual := stacked(outcomes)) is not None:
            terms = self._terms(residual)
        else:
            terms = np.full(len(self.channel_names), np.inf)
        return float(np.sum(terms)), terms

    def _terms(self, residual: FloatArray) -> FloatArray:
        """Cost terms per channel (c,) of stacked residuals (N,)."""
        total = np.zeros(len(self.channel_names))
        for slices in self.groups:
            parts = {name: residual[part] for name, part in zip(self.channel_names, slices, strict=True)}
            total += list(error_terms(parts, self.error).values())
        return total


def _name(case: Case, want: Want) -> str:
    return f"fit/{case.name}" if want is Want.TERMS else f"fit/{case.name} (residuals)"


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Recordings that are only scored, each with values of its own in the parameters' units."""

    cases: tuple[Case, ...]
    space: ParameterSpace
    names: tuple[str, ...]
    label: str = "held out"
    samples: int = 1

    @property
    def size(self) -> int:
        """Number of recordings."""
        return len(self.cases)

    @property
    def experiments(self) -> list[Experiment]:
        """Per recording the simulation that returns its signals."""
        return [case.experiment(f"validate/{case.name}", None) for case in self.cases]

    def decode(self, vectors: FloatArray) -> FloatArray:
        """Values as they are."""
        return vectors

    def jobs(
        self, want: Want, values: Sequence[Mapping[str, float]], overrides: Mapping[str, float]
    ) -> list[Job]:
        """One simulation per recording."""
        return [
            Job(f"validate/{case.name}", self.space.assignments(own) | dict(overrides), keep_signals=True)
            for case, own in zip(self.cases, values, strict=True)
        ]

    def judge(self, want: Want, outcomes: Sequence[Outcome]) -> tuple[float, FloatArray]:
        """Nothing is searched here: no cost."""
        return np.inf, np.zeros(0)


def build_point(scenario: Scenario, point: TemperaturePoint, given: Given | None = None) -> PointProblem:
    """The search at one of the scenario's points."""
    return PointProblem(
        label=point.label,
        temperature_degC=point.temperature_degC,
        cases=tuple(build_case(scenario, recording, point.fixed) for recording in point.fit),
        space=point.space,
        error=scenario.cost.error,
        also=tuple(name for name in scenario.cost.also if name != scenario.cost.error),
        given=given,
        profile=tuple(scenario.search.profile),
    )


def planned_vectors(search: SearchTable, dimension: int) -> int:
    """Return how many vectors a search over ``dimension`` parameters may take.

    Local searches are expected to agree, each after seven steps with one-sided differences; an evolution to take
    all its generations, its polish six steps. Central differences, twice, end both.
    """
    end = 2 + 4 * dimension
    if not search.polish:
        return evolved_vectors(search) + 2
    if search.method == "local-first":
        settings = LocalSettings()
        return settings.starts * (settings.hand + 7 * (dimension + 2)) + end
    return evolved_vectors(search) + 6 * (dimension + 2) + end


def evolved_vectors(search: SearchTable) -> int:
    """Return how many vectors an evolution tries at most."""
    return search.population * (search.generations + 1)
