"""What a study would run, and how long that takes: counted from the scenario, timed on a few of its runs."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thsa_cosim.batch import Experiment, Job, Outcome
from thsa_cosim.identify.problem import planned_vectors
from thsa_cosim.parameters import ParameterSpace
from thsa_cosim.scenario import AnyScenario, Executor, Scenario, SimulationTable, StagedScenario, TuneScenario
from thsa_cosim.study import build_case
from thsa_cosim.tune.problem import build_groups
from thsa_cosim.tune.run import planned_sets

SAMPLE = 12
"""Runs that are timed, besides one per worker to warm up."""
LONG_S = 5.0
"""Where a batch of one run per worker takes longer, it is all that is timed."""
STARTS = 8.0
"""What a study takes besides its runs (imports, comparisons, pictures, page), in starts of a worker: 4 to 12 of them in
the shipped scenarios."""
RARE = 5.0
"""Runs that take so many times the median count as that long."""


@dataclass(frozen=True)
class Search:
    """One search of a study: ``vectors`` parameter vectors, each simulated once per ``cases``."""

    label: str
    cases: tuple[str, ...]
    vectors: int

    @property
    def runs(self) -> int:
        """Simulations."""
        return self.vectors * len(self.cases)


@dataclass(frozen=True)
class Forecast:
    """What a scenario would run on ``workers`` processes; ``seconds`` is for all of it.

    ``expected``: local searches come first, and the runs are what they take where they agree; an evolution would be
    added where they do not. Otherwise the runs are the most that can happen.

    ``timed`` runs gave ``run_s``, the wall time between two finished runs; ``failures`` of them by reason.
    ``besides_s`` is what a study takes whatever it runs.
    ``also`` are simulations besides the searches (a map of the cost, held-out recordings, comparisons).
    """

    title: str
    searches: tuple[Search, ...]
    also: int
    workers: int
    timed: int
    run_s: float
    failures: dict[str, int]
    expected: bool = False
    besides_s: float = 0.0

    @property
    def runs(self) -> int:
        """Simulations, at most or expected."""
        return sum(search.runs for search in self.searches) + self.also

    @property
    def seconds(self) -> float:
        """Wall time, s."""
        return self.besides_s + self.runs * self.run_s


Ask = tuple[Experiment, ParameterSpace, str]
"""An experiment, what is searched in it, and the recording that its parameters may belong to."""


def forecast(study: AnyScenario, executor: Executor) -> tuple[Forecast, ...]:
    """Forecast a scenario: one entry, or one per stage of a scenario in stages.

    A few runs with random parameters are simulated for it; nothing is written.
    """
    if isinstance(study, StagedScenario):
        return tuple(_of_recordings(stage.scenario, executor) for stage in study.stages)
    if isinstance(study, TuneScenario):
        return (_of_tuning(study, executor),)
    return (_of_recordings(study, executor),)


def _of_recordings(scenario: Scenario, executor: Executor) -> Forecast:
    searches, asks = [], []
    for point in scenario.points if scenario.kind != "simulate" else ():
        cases = [build_case(scenario, recording, point.fixed) for recording in point.fit]
        vectors = planned_vectors(scenario.search, point.space.dimension)
        searches.append(Search(point.label, tuple(case.name for case in cases), vectors))
        asks += [(case.experiment(f"fit/{case.name}", None), point.space, case.name) for case in cases]
    alone = scenario.validate if searches else (*scenario.fit, *scenario.validate)
    asks += [
        (
            build_case(scenario, r, scenario.fixed).experiment(f"alone/{r.name}", None),
            ParameterSpace(()),
            r.name,
        )
        for r in alone
    ]
    title = scenario.title or scenario.path.stem
    found = _timed(title, searches, len(alone), asks, scenario.simulation, scenario.seed, executor)
    locally = bool(searches) and scenario.search.method == "local-first" and scenario.search.polish
    return replace(found, expected=locally)


def _of_tuning(scenario: TuneScenario, executor: Executor) -> Forecast:
    groups = build_groups(scenario)
    searches = [
        Search(
            group.label,
            tuple(case.condition.label for case in group.cases),
            planned_sets(scenario),
        )
        for group in groups
    ]
    sets = 2 + len(scenario.compare)
    also = sets * len(groups[0].cases)
    if scenario.surface is not None:
        also += scenario.surface.points**2 * len(groups[0].cases)
    if scenario.schedule is not None:
        also += (1 + sets) * int(np.prod([len(axis.values) for axis in scenario.schedule.check]))
    asks = [(case.experiment, scenario.parameters, "") for case in groups[0].cases]
    return _timed(scenario.title, searches, also, asks, scenario.simulation, scenario.seed, executor)


def _timed(
    title: str,
    searches: Sequence[Search],
    also: int,
    asks: Sequence[Ask],
    simulation: SimulationTable,
    seed: int,
    executor: Executor,
) -> Forecast:
    chosen = [asks[k] for k in np.unique(np.linspace(0, len(asks) - 1, SAMPLE).astype(int))]
    random = np.random.default_rng(seed)

    def jobs(count: int) -> list[Job]:
        drawn = []
        for k in range(count):
            experiment, space, recording = chosen[k % len(chosen)]
            values = space.decode(random.random(len(space)))
            drawn.append(Job(experiment.name, space.assignments(values, recording) if len(space) else {}))
        return drawn

    workers = executor.workers
    begin = time.perf_counter()
    with executor.open_runner(simulation, [experiment for experiment, *_ in chosen]) as runner:
        # The first run of a worker loads the FMU and compiles; the others are what a study is made of.
        runner.run(jobs(workers))
        started = time.perf_counter() - begin
        outcomes, seconds = _clock(runner.run, jobs(workers))
        if seconds < LONG_S:
            outcomes, seconds = _clock(runner.run, jobs(max(SAMPLE, 2 * workers)))
    failures = Counter(outcome.reason for outcome in outcomes if not outcome.ok)
    return Forecast(
        title,
        tuple(searches),
        also,
        workers,
        len(outcomes),
        _usual(outcomes, seconds, workers),
        dict(failures),
        besides_s=STARTS * max(started - _usual(outcomes, seconds, 1), 0.0),
    )


def _usual(outcomes: Sequence[Outcome], seconds: float, workers: int) -> float:
    """Seconds between two finished runs, where a run that takes many times as long as most does so only once.

    A search soon leaves the vectors that run into a deadline, or make a solver creep; among few random ones they weigh
    too much.
    """
    each = np.array([outcome.duration_s for outcome in outcomes])
    spared = float(np.sum(np.maximum(each - RARE * float(np.median(each)), 0.0))) / workers
    return (
        max(seconds - spared, 0.0) / len(outcomes) if spared < seconds else float(np.median(each)) / workers
    )


def _clock(run: Callable[[Sequence[Job]], list[Outcome]], jobs: Sequence[Job]) -> tuple[list[Outcome], float]:
    begin = time.perf_counter()
    return run(jobs), time.perf_counter() - begin
