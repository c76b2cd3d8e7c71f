"""The engine on a closed form: looked up what is known, kept in order, counted, and interrupted without loss."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from thsa_cosim.batch import Job, Journal, Outcome, Status
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study import Engine, Progress, Reply, Request, Want, stacked

TIME = np.array([0.0, 1.0])


@dataclass(frozen=True)
class Paraboloid:
    """Two cases, x and y, of a cost x² + y²; vectors are halves of the values."""

    label: str = "bowl"
    names: tuple[str, ...] = ("x", "y")
    size: int = 2
    samples: int = 2

    def decode(self, vectors: FloatArray) -> FloatArray:
        return 2.0 * vectors

    def jobs(
        self, want: Want, values: Sequence[Mapping[str, float]], overrides: Mapping[str, float]
    ) -> list[Job]:
        keep = want is Want.SIGNALS
        cases = zip(self.names, values, strict=True)
        return [Job(name, {"value": own[name], **overrides}, keep_signals=keep) for name, own in cases]

    def judge(self, want: Want, outcomes: Sequence[Outcome]) -> tuple[float, FloatArray]:
        found = stacked(outcomes)
        terms = np.full(2, np.inf) if found is None else found**2
        return float(np.sum(terms)), terms


@dataclass
class Formula:
    """Answers jobs in any ``order``; a value above 9 crashes; it may be cut short after so many runs."""

    backwards: bool = False
    stop_after: int = 10**9
    ran: list[Job] = field(default_factory=list)
    notes: tuple[str, ...] = ()

    def run(self, jobs: Sequence[Job], on_outcome: Any = None) -> list[Outcome]:
        found = []
        for job in jobs:
            value = job.values["value"]
            bad = value > 9.0
            signals = Signals(TIME, {"v": np.full(2, value)}) if job.keep_signals and not bad else None
            status, reason = (Status.CRASH, "too far") if bad else (Status.OK, "")
            found.append(Outcome(status, reason, signals, None if bad else np.array([value])))
        told = list(enumerate(found))
        for index, outcome in reversed(told) if self.backwards else told:
            if len(self.ran) >= self.stop_after:
                raise KeyboardInterrupt
            self.ran.append(jobs[index])
            on_outcome(index, outcome)
        return found

    def close(self) -> None:
        pass


BOWL = Paraboloid()
VECTORS = np.array([[0.5, 1.0], [6.0, 0.0], [1.5, 2.0]])


def asked(
    path: Path, runner: Formula, request: Request, problem: Paraboloid = BOWL, **more: Any
) -> tuple[Reply, Engine]:
    with Journal.open(path, ["other", "y", "x"], ["x", "y"]) as journal:
        engine = Engine(runner, journal, **more)  # type: ignore[arg-type]
        return engine.ask(problem, request), engine


def same(one: Reply, other: Reply) -> bool:
    arrays = [(r.costs.tobytes(), r.terms.tobytes()) for r in (one, other)]
    return arrays[0] == arrays[1] and one.reasons == other.reasons


def test_costs_terms_and_reasons_come_in_the_order_of_the_vectors(tmp_path: Path) -> None:
    reply, engine = asked(tmp_path / "j.csv", Formula(), Request(Want.TERMS, VECTORS))
    assert reply.costs.tolist() == [5.0, np.inf, 25.0]
    assert reply.terms[[0, 2]].tolist() == [[1.0, 4.0], [9.0, 16.0]]
    assert reply.reasons == ("", "too far", "")
    assert [r is None for r in reply.residuals] == [False, True, False]
    assert reply.signals == ((), None, ())
    assert (engine.evaluations["bowl"], engine.runs, engine.reused) == (3, 6, 0)
    assert engine.failures == {"too far": 1}


@pytest.mark.parametrize("backwards", [False, True])
def test_what_is_known_is_looked_up_and_the_journal_is_in_order(tmp_path: Path, backwards: bool) -> None:
    whole = asked(tmp_path / "whole.csv", Formula(), Request(Want.TERMS, VECTORS))[0]
    path, runner = tmp_path / "cut.csv", Formula(backwards, stop_after=3)
    with pytest.raises(KeyboardInterrupt):
        asked(path, runner, Request(Want.TERMS, VECTORS))
    again = Formula(backwards)
    reply, engine = asked(path, again, Request(Want.TERMS, VECTORS))
    assert same(reply, whole)
    assert path.read_bytes() == (tmp_path / "whole.csv").read_bytes()
    assert len(again.ran) == (6 if backwards else 4)
    assert engine.reused == 6 - len(again.ran)
    assert engine.failures == {"too far": 1}
    once_more, engine = asked(path, untouched := Formula(), Request(Want.TERMS, VECTORS))
    assert same(once_more, whole)
    assert (untouched.ran, engine.reused, engine.runs) == ([], 6, 6)


def test_rows_have_the_journals_columns_and_numbers_of_the_search(tmp_path: Path) -> None:
    with Journal.open(tmp_path / "j.csv", ["other", "y", "x"], ["x", "y"]) as journal:
        engine = Engine(Formula(), journal)  # type: ignore[arg-type]
        engine.ask(BOWL, Request(Want.TERMS, VECTORS[:1]))
        engine.ask(BOWL, Request(Want.RESIDUALS, VECTORS))
        engine.ask(replace(BOWL, label="second"), Request(Want.TERMS, VECTORS[2:]))
        engine.ask(BOWL, Request(Want.TERMS, VECTORS[1:] + 0.5))
        rows = [(row.stage, row.index, row.values, row.cost) for row in journal.rows]
    assert rows == [
        ("bowl", 1, (0.0, 2.0, 1.0), 5.0),
        ("bowl", -3, (0.0, 0.0, 12.0), np.inf),
        ("bowl", -4, (0.0, 4.0, 3.0), 25.0),
        ("second", 1, (0.0, 4.0, 3.0), 25.0),
        ("bowl", 2, (0.0, 1.0, 13.0), np.inf),
        ("bowl", 3, (0.0, 5.0, 4.0), 41.0),
    ]


@pytest.mark.parametrize(
    "request_",
    [
        Request(Want.SIGNALS, VECTORS),
        Request(Want.TERMS, VECTORS, journaled=False),
        Request(Want.RESIDUALS, VECTORS, overrides=({"more": 1.0},) * 3),
        Request(Want.TERMS, np.repeat(VECTORS[:, None, :], 2, axis=1)),
    ],
    ids=["signals", "not journaled", "overrides", "a vector per case"],
)
def test_what_is_no_vector_of_a_search_is_not_kept(tmp_path: Path, request_: Request) -> None:
    for _ in range(2):
        runner = Formula()
        reply, _ = asked(tmp_path / "j.csv", runner, request_)
        assert len(runner.ran) == 6
        assert reply.costs.tolist() == [5.0, np.inf, 25.0]
    assert len((tmp_path / "j.csv").read_text().splitlines()) == 1


def test_a_vector_per_case_and_overrides_reach_their_jobs() -> None:
    runner = Formula()
    own = np.array([[[0.5, 9.0], [9.0, 1.0]]])
    reply = Engine(runner).ask(BOWL, Request(Want.SIGNALS, own, overrides=({"more": 7.0},)))  # type: ignore[arg-type]
    assert [job.values for job in runner.ran] == [{"value": 1.0, "more": 7.0}, {"value": 2.0, "more": 7.0}]
    assert [s["v"][0] for s in reply.signals[0] or ()] == [1.0, 2.0]


def test_progress_counts_against_the_plan_and_gives_back_what_was_not_used(tmp_path: Path) -> None:
    told: list[Progress] = []
    with Journal.open(tmp_path / "j.csv", ["y", "x"], ["x", "y"]) as journal:
        engine = Engine(Formula(), journal, told.append, "trying")  # type: ignore[arg-type]
        engine.plan(BOWL, 10)
        engine.note_generation(4)
        engine.note_generation(2)
        engine.ask(BOWL, Request(Want.TERMS, VECTORS))
        engine.finish(BOWL)
    assert [p.runs for p in told] == [1, 2, 3, 4, 5, 6, 6, 6]
    assert told[0].planned == 20
    assert told[-1] == Progress("trying", 6, 6, 0, 1, {"bowl": 2.5}, 4)


def test_too_many_reasons_are_summed_up_by_status() -> None:
    class Talkative(Formula):
        def run(self, jobs: Sequence[Job], on_outcome: Any = None) -> list[Outcome]:
            found = [Outcome(Status.CRASH, f"at {job.values['value']}") for job in jobs]
            for index, outcome in enumerate(found):
                on_outcome(index, outcome)
            return found

    engine = Engine(Talkative())  # type: ignore[arg-type]
    engine.ask(BOWL, Request(Want.TERMS, np.arange(40.0).reshape(20, 2)))
    assert len(engine.failures) == 20
    engine.ask(BOWL, Request(Want.TERMS, np.array([[77.0, 0.0]])))
    assert engine.failures == {"crash": 21}


def test_residuals_in_single_precision_are_stacked_in_double() -> None:
    single = np.array([0.1, 0.2], dtype=np.float32)
    found = stacked([Outcome(Status.OK, reduced=single)] * 2)
    assert found is not None
    assert found.dtype == np.float64
    assert found.tolist() == 2 * single.astype(float).tolist()
