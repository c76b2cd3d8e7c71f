"""What is to be tuned, cut loose from files: conditions as experiments, and the groups that share gains."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from thsa_cosim.batch import Experiment, Job, Outcome
from thsa_cosim.scenario import TuneScenario
from thsa_cosim.scenario.tune_model import Condition, Requirement, combinations
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study import Want
from thsa_cosim.tune.combine import Combined, combine
from thsa_cosim.tune.response import Terms, reducer
from thsa_cosim.tune.samples import samples_at

ALL = "all conditions"


@dataclass(frozen=True, eq=False)
class SampledCondition:
    """One condition with one parameter sample (0: the values themselves) as a simulation."""

    condition: Condition
    sample: int
    experiment: Experiment


@dataclass(frozen=True, eq=False)
class Group:
    """Conditions that share one set of gains; a problem of the engine, whose vectors are in the parameters' units.

    ``at`` are the conditions that it is the schedule's node of.
    """

    scenario: TuneScenario
    label: str
    at: Mapping[str, float]
    cases: tuple[SampledCondition, ...]
    requirements: tuple[Requirement, ...]
    samples: int = 1
    """A cost is shown as it is."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the tuned parameters."""
        return self.scenario.parameters.names

    @property
    def size(self) -> int:
        """Number of simulations of one vector."""
        return len(self.cases)

    @cached_property
    def term_names(self) -> tuple[str, ...]:
        """Names of the terms of a response, in order."""
        return Terms.of(self.scenario).names

    @cached_property
    def weights(self) -> FloatArray:
        """Weight of each case (c,)."""
        return np.array([case.condition.weight for case in self.cases])

    def decode(self, vectors: FloatArray) -> FloatArray:
        """Values as they are."""
        return vectors

    def jobs(
        self, want: Want, values: Sequence[Mapping[str, float]], overrides: Mapping[str, float]
    ) -> list[Job]:
        """One simulation per condition and sample; each returns its terms, whatever else is wanted."""
        space, keep = self.scenario.parameters, want is Want.SIGNALS
        return [
            Job(case.experiment.name, {**space.assignments(own), **overrides}, keep_signals=keep)
            for case, own in zip(self.cases, values, strict=True)
        ]

    def judge(self, want: Want, outcomes: Sequence[Outcome]) -> tuple[float, FloatArray]:
        """Cost and worst terms (q,); the cost is infinite if a simulation failed."""
        found = self.combine(outcomes)
        return found.cost, found.worst

    def terms(self, outcomes: Sequence[Outcome]) -> FloatArray:
        """Terms (c, q) of each simulation, NaN of one that failed."""
        empty = np.full(len(self.term_names), np.nan)
        return np.stack([empty if o.reduced is None or not o.ok else o.reduced for o in outcomes])

    def combine(self, outcomes: Sequence[Outcome]) -> Combined:
        """One vector over all conditions, with the requirements."""
        found = combine(self.scenario, self.term_names, self.terms(outcomes), self.weights, self.requirements)
        if any(not o.ok for o in outcomes):
            return Combined(np.inf, np.nan, found.worst, found.excess, False)
        return found


def build_cases(
    scenario: TuneScenario, conditions: Sequence[Condition], *, sampled: bool
) -> tuple[SampledCondition, ...]:
    """The simulations of ``conditions``, with every parameter sample if ``sampled``."""
    cases = []
    for condition in conditions:
        samples = samples_at(scenario, condition) if sampled else ()
        for number, shifts in enumerate(({}, *samples)):
            cases.append(_case(scenario, condition, number, shifts))
    return tuple(cases)


def _case(
    scenario: TuneScenario, condition: Condition, number: int, shifts: Mapping[str, float]
) -> SampledCondition:
    command, fmu = scenario.command_of(condition.shown), scenario.fmu
    fixed = {**scenario.fixed, **condition.values, **shifts}
    columns = {command.input: command.values}
    columns |= {name: np.full(command.time.shape, value) for name, value in condition.inputs.items()}
    inputs = Signals(command.time, columns)
    if (profile := scenario.profile_of(condition.shown)) is not None:
        recorded = profile.inputs.resample(command.time)
        inputs = Signals(command.time, {**columns, **recorded.values}, held=recorded.held)
    reduce = reducer(scenario, inputs, fixed, command)
    label = condition.label or "response"
    return SampledCondition(
        condition,
        number,
        Experiment(
            name=f"{label} sample {number}" if number else label,
            fmu=fmu.path,
            inputs=inputs,
            outputs=reduce.recorded,
            time=command.time,
            fixed=fixed,
            tolerance=scenario.simulation.tolerance,
            reduce=reduce,
            texts=scenario.texts,
        ),
    )


def build_groups(scenario: TuneScenario) -> tuple[Group, ...]:
    """The group of all conditions first, then one group per node of the schedule, if there is one."""
    cases = build_cases(scenario, combinations(scenario.axes), sampled=True)
    groups = [Group(scenario, ALL, {}, cases, scenario.requirements)]
    if scenario.schedule is None:
        return tuple(groups)
    tight = tuple(r.tightened(scenario.schedule.reserve) for r in scenario.requirements)
    nodes = combinations([axis for axis in scenario.axes if axis.name in scenario.schedule.over])
    for node in nodes:
        members = tuple(c for c in cases if node.shown.items() <= c.condition.shown.items())
        groups.append(Group(scenario, node.label, node.shown, members, tight))
    return tuple(groups)
