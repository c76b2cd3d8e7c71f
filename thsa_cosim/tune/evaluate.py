"""Vectors → simulations → costs, with the journal in between.

A vector is simulated under every condition of its group. What was evaluated before is looked up in the
journal, so that a study that is run again repeats what it knows and goes on from there.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.batch import Job, Journal, JournalRow, Outcome, Runner, Status
from thsa_cosim.scenario import TuneScenario
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study import OnProgress, Progress
from thsa_cosim.tune.combine import Combined, combine
from thsa_cosim.tune.problem import Case, Group


@dataclass(frozen=True, eq=False)
class Request:
    """Parameter values (m, n) of a group to be evaluated, in the parameters' units."""

    values: FloatArray


@dataclass(frozen=True, eq=False)
class Reply:
    """Costs (m,) and worst terms (m, q); a vector that failed has an infinite cost and the reason."""

    costs: FloatArray
    worst: FloatArray
    reasons: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """One set of values under every case of a group: terms (c, q), their combination, and the signals."""

    values: dict[str, float]
    terms: FloatArray
    combined: Combined
    signals: tuple[Signals | None, ...]
    reason: str


class Evaluator:
    """Answers the requests of all groups' searches over one runner."""

    def __init__(
        self,
        scenario: TuneScenario,
        runner: Runner,
        journal: Journal,
        groups: Sequence[Group],
        names: Sequence[str],
        on_progress: OnProgress | None = None,
    ) -> None:
        self.evaluations = 0
        self.planned = 0
        self.names = tuple(names)
        self._scenario = scenario
        self._runner = runner
        self._journal = journal
        self._groups = groups
        self._on_progress = on_progress
        self._failed: Counter[str] = Counter()
        self._asked: Counter[str] = Counter()
        self._runs = self._reused = self._generation = 0
        self._best: dict[str, float] = {}

    @property
    def failures(self) -> dict[str, int]:
        """Failed evaluations by reason."""
        return dict(sorted(self._failed.items()))

    def plan(self, group: int, evaluations: int) -> None:
        """Expect so many further vectors of a group; negative numbers take them off the plan."""
        self.planned += evaluations * len(self._groups[group].cases)

    def note_generation(self, generation: int) -> None:
        """Some search has finished a generation."""
        self._generation = max(self._generation, generation)

    def serve(self, requests: Sequence[tuple[int, Request]]) -> list[Reply]:
        """Simulate all vectors of all requests as one batch of jobs; one reply per request, in order."""
        space = self._scenario.parameters
        costs = [np.full(len(r.values), np.inf) for _, r in requests]
        worst = [np.full((len(r.values), len(self.names)), np.nan) for _, r in requests]
        reasons = [[""] * len(r.values) for _, r in requests]
        jobs: list[Job] = []
        waiting: list[tuple[int, int, int]] = []
        # Numbers of a group's evaluations: by them the generations can be told from the journal.
        first: list[int] = []
        for position, (k, request) in enumerate(requests):
            group = self._groups[k]
            first.append(self._asked[group.label] + 1)
            self._asked[group.label] += len(request.values)
            for row, values in enumerate(request.values.tolist()):
                self.evaluations += 1
                known = self._journal.known(group.label, values)
                if known is not None:
                    self._runs += len(group.cases)
                    self._reused += len(group.cases)
                    costs[position][row], worst[position][row] = known.cost, known.terms
                    reasons[position][row] = known.reason
                    self._note(group, known.cost, known.reason)
                    continue
                waiting.append((position, row, len(jobs)))
                named = dict(zip(space.names, values, strict=True))
                jobs += [Job(case.experiment.name, space.assignments(named)) for case in group.cases]
        rows: list[JournalRow] = []
        for (position, row, _), outcomes in self._run(jobs, waiting, requests):
            k, request = requests[position]
            group = self._groups[k]
            found = self._judge(group, outcomes)
            failed = next((o for o in outcomes if not o.ok), None)
            reason = "" if failed is None else failed.reason
            costs[position][row], worst[position][row] = found.cost, found.worst
            reasons[position][row] = reason
            self._note(group, found.cost, reason)
            rows.append(
                JournalRow(
                    stage=group.label,
                    index=first[position] + row,
                    values=tuple(request.values[row].tolist()),
                    cost=found.cost,
                    terms=tuple(found.worst.tolist()),
                    status=Status.OK if failed is None else failed.status,
                    reason=reason,
                )
            )
        self._journal.append(rows)
        self._report()
        return [Reply(c, w, tuple(r)) for c, w, r in zip(costs, worst, reasons, strict=True)]

    def evaluate(
        self, group: Group, sets: Sequence[dict[str, float]], *, keep_signals: bool = False
    ) -> list[Evaluation]:
        """Evaluate whole sets of values under every case of ``group``, outside of the journal."""
        return self.evaluate_each(group, [[values] * len(group.cases) for values in sets], keep_signals)

    def evaluate_each(
        self, group: Group, sets: Sequence[Sequence[dict[str, float]]], keep_signals: bool = False
    ) -> list[Evaluation]:
        """The same with values of its own for every case (a schedule); ``values`` is then that of the first."""
        space = self._scenario.parameters
        jobs = [
            Job(case.experiment.name, space.assignments(values), keep_signals=keep_signals)
            for each in sets
            for case, values in zip(group.cases, each, strict=True)
        ]
        outcomes = self._runner.run(jobs)
        found = []
        for k, each in enumerate(sets):
            part = outcomes[k * len(group.cases) : (k + 1) * len(group.cases)]
            self.evaluations += 1
            found.append(
                Evaluation(
                    values=dict(each[0]),
                    terms=self._terms(part),
                    combined=self._judge(group, part),
                    signals=tuple(o.signals for o in part),
                    reason=next((o.reason for o in part if not o.ok), ""),
                )
            )
        return found

    def _run(
        self,
        jobs: list[Job],
        waiting: list[tuple[int, int, int]],
        requests: Sequence[tuple[int, Request]],
    ) -> "list[tuple[tuple[int, int, int], list[Outcome]]]":
        def on_outcome(_: int, __: Outcome) -> None:
            self._runs += 1
            self._report()

        outcomes = self._runner.run(jobs, on_outcome) if jobs else []
        found = []
        for entry in waiting:
            count = len(self._groups[requests[entry[0]][0]].cases)
            found.append((entry, outcomes[entry[2] : entry[2] + count]))
        return found

    def _terms(self, outcomes: Sequence[Outcome]) -> FloatArray:
        empty = np.full(len(self.names), np.nan)
        return np.stack([empty if o.reduced is None or not o.ok else o.reduced for o in outcomes])

    def _judge(self, group: Group, outcomes: Sequence[Outcome]) -> Combined:
        found = combine(self._scenario, self.names, self._terms(outcomes), group.weights, group.requirements)
        if any(not o.ok for o in outcomes):
            return Combined(np.inf, np.nan, found.worst, found.excess, False)
        return found

    def _note(self, group: Group, cost: float, reason: str) -> None:
        if reason:
            self._failed[reason] += 1
        self._best[group.label] = min(cost, self._best.get(group.label, np.inf))

    def _report(self) -> None:
        if self._on_progress is not None:
            failed = sum(self._failed.values())
            self._on_progress(
                Progress(
                    "tuning",
                    self._runs,
                    self.planned,
                    self._reused,
                    failed,
                    dict(self._best),
                    self._generation,
                )
            )


def cases_of(groups: Sequence[Group]) -> list[Case]:
    """Every case once, in order."""
    return list({case.experiment.name: case for group in groups for case in group.cases}.values())
