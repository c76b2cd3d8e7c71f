"""Vectors × cases → simulations → costs, residuals or signals, with the journal in between.

Whoever searches asks for vectors of a problem; every vector is simulated in each of the problem's cases. What was
asked for its cost before is looked up in the journal, so that a study that is run again repeats what it knows.
Residuals are too large to be kept there: of vectors whose residuals were asked for, the journal holds the cost.
"""

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

import numpy as np

from thsa_cosim.batch import Job, Journal, JournalRow, Outcome, Runner, Status
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study.place import OnProgress, Progress

#: Seconds between two writes to the journal: what a power cut may cost.
WRITE_EVERY = 1.0
#: More reasons for failures than this are summed up by status.
MANY_REASONS = 20


class Want(Enum):
    """What is asked of a simulation."""

    TERMS = "terms"
    RESIDUALS = "residuals"
    SIGNALS = "signals"


@dataclass(frozen=True, eq=False)
class Request:
    """Vectors (m, n) of a problem to be simulated, or (m, c, n) with a vector of its own for each of its cases.

    ``overrides``: per vector further start values, which win over the problem's; empty for none. What has either, and
    what is not ``journaled``, is neither looked up nor kept.
    """

    want: Want
    vectors: FloatArray
    overrides: tuple[Mapping[str, float], ...] = ()
    journaled: bool = True

    @property
    def is_journaled(self) -> bool:
        """Whether the cost of its vectors belongs into the journal."""
        return (
            self.journaled and not self.overrides and self.vectors.ndim == 2 and self.want is not Want.SIGNALS
        )


@dataclass(frozen=True, eq=False)
class Reply:
    """Per vector: its cost (m,), its cost terms (m, q), and the outcomes of its cases.

    A vector that failed has the reason (else "") and an infinite cost; of one that the journal knew there are no
    outcomes.
    """

    costs: FloatArray
    terms: FloatArray
    outcomes: tuple[tuple[Outcome, ...], ...]
    reasons: tuple[str, ...]

    @property
    def residuals(self) -> tuple[FloatArray | None, ...]:
        """Per vector the stacked residuals (N,) of its cases, None where one failed."""
        return tuple(stacked(own) for own in self.outcomes)

    @property
    def signals(self) -> tuple[tuple[Signals, ...] | None, ...]:
        """Per vector the signals of its cases, None where one failed."""
        return tuple(
            tuple(o.signals for o in own if o.signals is not None) if own and all(o.ok for o in own) else None
            for own in self.outcomes
        )


def stacked(outcomes: Sequence[Outcome]) -> FloatArray | None:
    """What the workers made of the cases of a vector, one after the other (N,); None where one failed."""
    parts = [o.reduced for o in outcomes if o.ok and o.reduced is not None]
    return np.concatenate(parts, dtype=np.float64) if parts and len(parts) == len(outcomes) else None


class Problem(Protocol):
    """What vectors stand for: the cases in which they are simulated, and what they cost."""

    @property
    def label(self) -> str:
        """What the vectors belong to, in the journal and for the counts."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of the values."""
        ...

    @property
    def size(self) -> int:
        """Number of cases, the simulations that a vector takes."""
        ...

    @property
    def samples(self) -> int:
        """Number that a cost is divided by where it is shown."""
        ...

    def decode(self, vectors: FloatArray) -> FloatArray:
        """Vectors (..., n) as values in the parameters' units."""
        ...

    def jobs(
        self, want: Want, values: Sequence[Mapping[str, float]], overrides: Mapping[str, float]
    ) -> list[Job]:
        """The simulations of one vector; ``values`` by name, for each case."""
        ...

    def judge(self, want: Want, outcomes: Sequence[Outcome]) -> tuple[float, FloatArray]:
        """Cost and cost terms (q,) of one vector; infinite if a case failed."""
        ...


@dataclass
class _Vector:
    """One vector on its way: the outcomes of its cases as they arrive."""

    problem: Problem
    request: Request
    reply: "_Reply"
    row: int
    number: int
    """Of the vector among those of a search: by it the generations can be told from the journal."""
    values: tuple[float, ...]
    outcomes: list[Outcome | None] = field(default_factory=list)


class Engine:
    """Answers requests over one runner; counts vectors by the label of their problem.

    ``journal``: of a problem's parameters and cost terms; without, nothing is looked up. ``step``: what its progress is
    called.
    """

    def __init__(
        self,
        runner: Runner,
        journal: Journal | None = None,
        on_progress: OnProgress | None = None,
        step: str = "searching",
    ) -> None:
        self.evaluations: Counter[str] = Counter()
        self.runs = 0
        self.reused = 0
        self.planned = 0
        self._runner = runner
        self._journal = journal
        self._on_progress = on_progress
        self.step = step
        self._failed: Counter[tuple[str, str]] = Counter()
        self._numbers: Counter[str] = Counter()
        self._spent: Counter[str] = Counter()
        self._share: Counter[str] = Counter()
        self._best: dict[str, float] = {}
        self._generation = 0

    # -- counts ---------------------------------------------------------------------------------------
    def plan(self, problem: Problem, vectors: int) -> None:
        """Expect so many further vectors of a problem."""
        self._share[problem.label] += vectors * problem.size
        self.planned += vectors * problem.size

    def finish(self, problem: Problem) -> None:
        """A problem needs no more: what it did not use comes off the plan."""
        label = problem.label
        self.planned += self._spent[label] - self._share[label]
        self._share[label] = self._spent[label]
        self.report()

    def note_generation(self, generation: int) -> None:
        """Some search has finished a generation."""
        self._generation = max(self._generation, generation)

    @property
    def failures(self) -> dict[str, int]:
        """Failed vectors by reason; by status alone where reasons are too many to read."""
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
            failed, best = sum(self._failed.values()), dict(self._best)
            self._on_progress(
                Progress(self.step, self.runs, self.planned, self.reused, failed, best, self._generation)
            )

    # -- requests -------------------------------------------------------------------------------------
    def serve(self, requests: Sequence[tuple[Problem, Request]]) -> list[Reply]:
        """Simulate all vectors of all requests as one batch of jobs; one reply per request, in order."""
        replies: list[_Reply] = []
        jobs: list[Job] = []
        owners: list[tuple[_Vector, int]] = []
        for problem, request in requests:
            replies.append(reply := _Reply(len(request.vectors)))
            for row, values in enumerate(problem.decode(request.vectors)):
                vector = self._vector(problem, request, reply, row, values)
                if self._recall(vector):
                    continue
                each = values if values.ndim == 2 else [values] * problem.size
                named = [dict(zip(problem.names, own.tolist(), strict=True)) for own in each]
                overrides = request.overrides[row] if request.overrides else {}
                for case, job in enumerate(problem.jobs(request.want, named, overrides)):
                    vector.outcomes.append(None)
                    jobs.append(job)
                    owners.append((vector, case))
        self._run(jobs, owners)
        return [reply.freeze() for reply in replies]

    def ask(self, problem: Problem, request: Request) -> Reply:
        """Answer a single request."""
        return self.serve([(problem, request)])[0]

    def _vector(
        self, problem: Problem, request: Request, reply: "_Reply", row: int, values: FloatArray
    ) -> _Vector:
        label = problem.label
        self.evaluations[label] += 1
        counts = request.want is Want.TERMS and request.is_journaled
        self._numbers[label] += counts
        # What belongs to no generation is numbered below zero.
        number = self._numbers[label] if counts else -self.evaluations[label]
        return _Vector(problem, request, reply, row, number, self._columns(problem, request, values))

    def _columns(self, problem: Problem, request: Request, values: FloatArray) -> tuple[float, ...]:
        """Values in the journal's order; 0 for a parameter that only other problems have."""
        if self._journal is None or not request.is_journaled:
            return ()
        named = dict(zip(problem.names, values.tolist(), strict=True))
        return tuple(named.get(name, 0.0) for name in self._journal.names)

    def _recall(self, vector: _Vector) -> bool:
        request, problem = vector.request, vector.problem
        if self._journal is None or request.want is not Want.TERMS or not request.is_journaled:
            return False
        known = self._journal.known(problem.label, vector.values)
        if known is None:
            return False
        failed = None if known.status == Status.OK else (str(known.status), known.reason)
        self._settle(vector, known.cost, np.array(known.terms), (), failed)
        self.reused += problem.size
        self.runs += problem.size
        self._spent[problem.label] += problem.size
        return True

    def _run(self, jobs: list[Job], owners: list[tuple[_Vector, int]]) -> None:
        # Rows are kept in the order of the batch, whatever the number of workers; the log of runs has the rest.
        order = list({id(vector): vector for vector, _ in owners}.values())
        rows: list[JournalRow] = []
        finished: dict[int, JournalRow] = {}
        head, written = 0, time.monotonic()

        def write() -> None:
            nonlocal written
            if rows and self._journal is not None:
                self._journal.append(rows)
                rows.clear()
            written = time.monotonic()

        def on_outcome(index: int, outcome: Outcome) -> None:
            nonlocal head
            vector, case = owners[index]
            vector.outcomes[case] = outcome
            self.runs += 1
            self._spent[vector.problem.label] += 1
            if None not in vector.outcomes:
                finished[id(vector)] = self._finish(vector)
            while head < len(order) and (row := finished.pop(id(order[head]), None)) is not None:
                if self._is_new(order[head].request, row):
                    rows.append(row)
                head += 1
            if time.monotonic() - written >= WRITE_EVERY:
                write()
            self.report()

        try:
            if jobs:
                self._runner.run(jobs, on_outcome)
        finally:
            write()
        self.report()

    def _finish(self, vector: _Vector) -> JournalRow:
        outcomes = tuple(outcome for outcome in vector.outcomes if outcome is not None)
        cost, terms = vector.problem.judge(vector.request.want, outcomes)
        bad = next((o for o in outcomes if not o.ok), None)
        failed = None if bad is None else (str(bad.status), bad.reason)
        self._settle(vector, cost, terms, outcomes, failed)
        return JournalRow(
            stage=vector.problem.label,
            index=vector.number,
            values=vector.values,
            cost=cost,
            terms=tuple(terms.tolist()),
            status=Status.OK if bad is None else bad.status,
            reason="" if bad is None else bad.reason,
        )

    def _settle(
        self,
        vector: _Vector,
        cost: float,
        terms: FloatArray,
        outcomes: tuple[Outcome, ...],
        failed: tuple[str, str] | None,
    ) -> None:
        """Write what became of a vector into its reply, and count it."""
        reply, row, problem = vector.reply, vector.row, vector.problem
        reply.costs[row], reply.terms[row], reply.outcomes[row] = cost, terms, outcomes
        if failed is not None:
            reply.reasons[row] = failed[1]
            self._failed[failed] += 1
        elif vector.request.is_journaled:
            best = self._best.get(problem.label, np.inf)
            self._best[problem.label] = min(cost / problem.samples, best)

    def _is_new(self, request: Request, row: JournalRow) -> bool:
        """Whether the journal lacks a row: the same vector may be asked for in several ways."""
        if self._journal is None or not request.is_journaled:
            return False
        return request.want is Want.TERMS or self._journal.known(row.stage, row.values) is None


class _Reply:
    """A reply while it is being filled."""

    def __init__(self, vectors: int) -> None:
        self.costs = np.full(vectors, np.inf)
        self.terms: list[FloatArray] = [np.zeros(0)] * vectors
        self.outcomes: list[tuple[Outcome, ...]] = [()] * vectors
        self.reasons = [""] * vectors

    def freeze(self) -> Reply:
        terms = np.stack(self.terms) if self.terms else np.zeros((0, 0))
        return Reply(self.costs, terms, tuple(self.outcomes), tuple(self.reasons))
