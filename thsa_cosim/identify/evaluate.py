"""Vectors → simulations → cost terms, residuals or signals, with the journal in between.

A vector of a point is simulated against each recording of that point. Cost terms are looked up in the
journal first and written to it as they come, so that a study that is run again repeats what it knows.
Residuals are too large to be kept: of vectors whose residuals were asked for, the journal holds the cost.
"""

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from thsa_cosim.batch import Experiment, Job, Journal, JournalRow, Outcome, Runner, Status
from thsa_cosim.costs.channels import ResidualReducer, TermsReducer
from thsa_cosim.costs.identification import error_terms
from thsa_cosim.identify.problem import Case, PointProblem
from thsa_cosim.scenario import SearchTable
from thsa_cosim.search import LocalSettings
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study import OnProgress, Progress

#: Seconds between two writes to the journal: what a power cut may cost.
WRITE_EVERY = 1.0
#: More reasons for failures than this are summed up by status.
MANY_REASONS = 20


class Want(Enum):
    """What a search asks for."""

    TERMS = "terms"
    RESIDUALS = "residuals"
    SIGNALS = "signals"


@dataclass(frozen=True, eq=False)
class Request:
    """Vectors (m, n) in the unit cube to be simulated at a point.

    ``overrides``: per vector further start values, which win over the scenario's; empty for none.
    """

    want: Want
    vectors: FloatArray
    overrides: tuple[Mapping[str, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Reply:
    """Per vector: cost terms per channel (m, c), stacked residuals, or signals per recording.

    A vector that failed has infinite terms and None elsewhere; ``reasons`` holds why, or "".
    """

    terms: FloatArray
    residuals: tuple[FloatArray | None, ...]
    signals: tuple[tuple[Signals, ...] | None, ...]
    reasons: tuple[str, ...]


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


def terms_experiment(case: Case, error: str) -> Experiment:
    """The simulation of a recording that returns its cost terms."""
    return case.experiment(_name(case, Want.TERMS), TermsReducer(case.channels, error))


def residual_experiment(case: Case) -> Experiment:
    """The simulation of a recording that returns its residuals (or, if asked, its signals)."""
    return case.experiment(_name(case, Want.RESIDUALS), ResidualReducer(case.channels))


def _name(case: Case, want: Want) -> str:
    return f"fit/{case.name}" if want is Want.TERMS else f"fit/{case.name} (residuals)"


@dataclass
class _Vector:
    """One vector on its way: the outcomes of its recordings as they arrive."""

    point: int
    row: int
    number: int
    """Of the vector among those of an evolution: by it the generations can be told from the journal."""
    values: dict[str, float]
    missing: int
    outcomes: list[Outcome | None] = field(default_factory=list)


class Evaluator:
    """Answers the requests of all points' searches over one runner."""

    def __init__(
        self,
        runner: Runner,
        journal: Journal,
        points: Sequence[PointProblem],
        names: Sequence[str],
        channels: Sequence[str],
        on_progress: OnProgress | None = None,
    ) -> None:
        self._failed: Counter[tuple[str, str]] = Counter()
        self.evaluations: list[int] = [0] * len(points)
        self.reused = 0
        self.runs = 0
        self.planned = 0
        self._runner = runner
        self._journal = journal
        self._points = points
        self._names = tuple(names)
        self._channels = tuple(channels)
        self._spent: list[int] = [0] * len(points)
        self._share: list[int] = [0] * len(points)
        self._numbers: list[int] = [0] * len(points)
        self._on_progress = on_progress
        self._best: dict[str, float] = {}
        self._generation = 0

    def serve(self, requests: Sequence[tuple[int, Request]]) -> list[Reply]:
        """Simulate all vectors of all requests as one batch of jobs; one reply per request, in order."""
        replies = [_empty(request, len(self._channels)) for _, request in requests]
        jobs: list[Job] = []
        owners: list[tuple[_Vector, int, int]] = []
        for position, (k, request) in enumerate(requests):
            point = self._points[k]
            for row, values in enumerate(point.space.physical(request.vectors)):
                named = dict(zip(point.space.names, values.tolist(), strict=True))
                self.evaluations[k] += 1
                self._numbers[k] += request.want is Want.TERMS
                if request.want is Want.TERMS and self._recall(k, row, named, replies[position]):
                    continue
                # What belongs to no generation is numbered below zero.
                number = self._numbers[k] if request.want is Want.TERMS else -self.evaluations[k]
                vector = _Vector(k, row, number, named, len(point.cases), [None] * len(point.cases))
                for c, case in enumerate(point.cases):
                    assigned = point.space.assignments(named, case.name)
                    if request.overrides:
                        assigned |= request.overrides[row]
                    keep = request.want is Want.SIGNALS
                    jobs.append(Job(_name(case, request.want), assigned, keep_signals=keep))
                    owners.append((vector, c, position))
        self._run(jobs, owners, requests, replies)
        return [reply.freeze() for reply in replies]

    def plan(self, search: SearchTable) -> None:
        """Expect at every point what ``search`` may take."""
        for k, point in enumerate(self._points):
            self._share[k] = planned_vectors(search, point.space.dimension) * len(point.cases)
        self.planned = sum(self._share)
        self.report()

    def expect_evolution(self, k: int, search: SearchTable) -> None:
        """Point ``k`` needs an evolution that was not planned."""
        further = evolved_vectors(search) * len(self._points[k].cases)
        self._share[k] += further
        self.planned += further

    def note_generation(self, k: int, generation: int) -> None:
        """Point ``k`` has finished a generation."""
        self._generation = max(self._generation, generation)

    def finish_point(self, k: int) -> None:
        """Point ``k`` needs no more: what it did not use comes off the plan."""
        self.planned += self._spent[k] - self._share[k]
        self._share[k] = self._spent[k]
        self.report()

    @property
    def failures(self) -> dict[str, int]:
        """Failed evaluations by reason; by status alone where reasons are too many to read."""
        if len(self._failed) <= MANY_REASONS:
            return dict(sorted(self._by(lambda status, reason: reason or status).items()))
        return dict(sorted(self._by(lambda status, reason: status).items()))

    def _by(self, key: Callable[[str, str], str]) -> Counter[str]:
        total: Counter[str] = Counter()
        for (status, reason), count in self._failed.items():
            total[key(status, reason)] += count
        return total

    def report(self) -> None:
        """Tell how far the study is."""
        if self._on_progress is not None:
            failed = sum(self._failed.values())
            stage = "searching"
            self._on_progress(
                Progress(
                    stage, self.runs, self.planned, self.reused, failed, dict(self._best), self._generation
                )
            )

    def _recall(self, k: int, row: int, named: dict[str, float], reply: "_Reply") -> bool:
        known = self._journal.known(self._points[k].label, self._columns(named))
        if known is None:
            return False
        reply.terms[row] = known.terms if known.status == Status.OK else np.inf
        reply.reasons[row] = "" if known.status == Status.OK else known.reason
        if known.status != Status.OK:
            self._failed[str(known.status), known.reason] += 1
        else:
            self._note_best(k, float(np.sum(known.terms)))
        runs = len(self._points[k].cases)
        self.reused += runs
        self.runs += runs
        self._spent[k] += runs
        return True

    def _run(
        self,
        jobs: list[Job],
        owners: list[tuple[_Vector, int, int]],
        requests: Sequence[tuple[int, Request]],
        replies: "list[_Reply]",
    ) -> None:
        rows: list[JournalRow] = []
        written = time.monotonic()

        def write() -> None:
            nonlocal written
            if rows:
                self._journal.append(rows)
                rows.clear()
            written = time.monotonic()

        def on_outcome(index: int, outcome: Outcome) -> None:
            vector, c, position = owners[index]
            vector.outcomes[c] = outcome
            vector.missing -= 1
            self.runs += 1
            self._spent[vector.point] += 1
            if vector.missing == 0:
                request = requests[position][1]
                row = self._finish(vector, request, replies[position])
                if self._is_new(request, row):
                    rows.append(row)
            if time.monotonic() - written >= WRITE_EVERY:
                write()
            self.report()

        try:
            if jobs:
                self._runner.run(jobs, on_outcome)
        finally:
            write()
        self.report()

    def _finish(self, vector: _Vector, request: Request, reply: "_Reply") -> JournalRow:
        outcomes = [outcome for outcome in vector.outcomes if outcome is not None]
        failed = next((o for o in outcomes if o.status != Status.OK), None)
        row = vector.row
        if failed is None:
            if request.want is Want.TERMS:
                total = np.sum([o.reduced for o in outcomes if o.reduced is not None], axis=0)
                reply.terms[row] = total
                self._note_best(vector.point, float(np.sum(total)))
            elif request.want is Want.RESIDUALS:
                residual = np.concatenate([o.reduced for o in outcomes if o.reduced is not None])
                reply.residuals[row] = residual
                reply.terms[row] = self._terms(vector.point, residual)
                self._note_best(vector.point, float(np.sum(reply.terms[row])))
            else:
                reply.signals[row] = tuple(o.signals for o in outcomes if o.signals is not None)
        else:
            reply.reasons[row] = failed.reason
            self._failed[str(failed.status), failed.reason] += 1
        terms = reply.terms[row]
        return JournalRow(
            stage=self._points[vector.point].label,
            index=vector.number,
            values=self._columns(vector.values),
            cost=float(np.sum(terms)),
            terms=tuple(terms.tolist()),
            status=Status.OK if failed is None else failed.status,
            reason="" if failed is None else failed.reason,
        )

    def _is_new(self, request: Request, row: JournalRow) -> bool:
        """Whether the journal lacks a row: the same vector may be asked for in several ways."""
        if request.want is Want.SIGNALS or request.overrides:
            return False
        return request.want is Want.TERMS or self._journal.known(row.stage, row.values) is None

    def _terms(self, k: int, residual: FloatArray) -> FloatArray:
        """Cost terms per channel (c,) of stacked residuals."""
        point = self._points[k]
        total = np.zeros(len(self._channels))
        for slices in point.groups:
            parts = {name: residual[part] for name, part in zip(point.channel_names, slices, strict=True)}
            total += list(error_terms(parts, point.error).values())
        return total

    def _columns(self, named: Mapping[str, float]) -> tuple[float, ...]:
        """Values in the journal's order; 0 for a parameter that only other points have."""
        return tuple(named.get(name, 0.0) for name in self._names)

    def _note_best(self, k: int, cost: float) -> None:
        point = self._points[k]
        per_sample = cost / point.samples
        self._best[point.label] = min(per_sample, self._best.get(point.label, np.inf))


class _Reply:
    """A reply while it is being filled."""

    def __init__(self, vectors: int, channels: int) -> None:
        self.terms = np.full((vectors, channels), np.inf)
        self.residuals: list[FloatArray | None] = [None] * vectors
        self.signals: list[tuple[Signals, ...] | None] = [None] * vectors
        self.reasons = [""] * vectors

    def freeze(self) -> Reply:
        return Reply(self.terms, tuple(self.residuals), tuple(self.signals), tuple(self.reasons))


def _empty(request: Request, channels: int) -> _Reply:
    return _Reply(len(request.vectors), channels)
