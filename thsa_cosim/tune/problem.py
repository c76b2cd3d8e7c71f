"""What is to be tuned, cut loose from files: conditions as experiments, and the groups that share gains."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.batch import Experiment
from thsa_cosim.scenario import TuneScenario
from thsa_cosim.scenario.tune_model import Condition, Requirement, combinations
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.tune.response import reducer
from thsa_cosim.tune.samples import samples_at

ALL = "all conditions"


@dataclass(frozen=True, eq=False)
class Case:
    """One condition with one parameter sample (0: the values themselves) as a simulation."""

    condition: Condition
    sample: int
    experiment: Experiment


@dataclass(frozen=True, eq=False)
class Group:
    """Conditions that share one set of gains; ``at`` are those it is the schedule's node of."""

    label: str
    at: Mapping[str, float]
    cases: tuple[Case, ...]
    requirements: tuple[Requirement, ...]

    @property
    def weights(self) -> FloatArray:
        """Weight of each case (c,)."""
        return np.array([case.condition.weight for case in self.cases])


def build_cases(
    scenario: TuneScenario, conditions: Sequence[Condition], *, sampled: bool
) -> tuple[Case, ...]:
    """The simulations of ``conditions``, with every parameter sample if ``sampled``."""
    cases = []
    for condition in conditions:
        samples = samples_at(scenario, condition) if sampled else ()
        for number, shifts in enumerate(({}, *samples)):
            cases.append(_case(scenario, condition, number, shifts))
    return tuple(cases)


def _case(scenario: TuneScenario, condition: Condition, number: int, shifts: Mapping[str, float]) -> Case:
    command, fmu = scenario.command, scenario.fmu
    fixed = {**scenario.fixed, **condition.values, **shifts}
    reduce = reducer(scenario, condition.inputs, fixed)
    columns = {command.input: command.values}
    columns |= {name: np.full(command.time.shape, value) for name, value in condition.inputs.items()}
    label = condition.label or "response"
    return Case(
        condition,
        number,
        Experiment(
            name=f"{label} sample {number}" if number else label,
            fmu=fmu.path,
            inputs=Signals(command.time, columns),
            outputs=reduce.recorded,
            time=command.time,
            fixed=fixed,
            tolerance=scenario.simulation.tolerance,
            reduce=reduce,
        ),
    )


def build_groups(scenario: TuneScenario) -> tuple[Group, ...]:
    """The group of all conditions first, then one group per node of the schedule, if there is one."""
    cases = build_cases(scenario, combinations(scenario.axes), sampled=True)
    groups = [Group(ALL, {}, cases, scenario.requirements)]
    if scenario.schedule is None:
        return tuple(groups)
    tight = tuple(r.tightened(scenario.schedule.reserve) for r in scenario.requirements)
    nodes = combinations([axis for axis in scenario.axes if axis.name in scenario.schedule.over])
    for node in nodes:
        members = tuple(c for c in cases if node.shown.items() <= c.condition.shown.items())
        groups.append(Group(node.label, node.shown, members, tight))
    return tuple(groups)
