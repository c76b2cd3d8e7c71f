"""What local processes and clusters have in common."""

from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import Protocol, Self

from thsa_cosim.batch.job import Experiment, Job
from thsa_cosim.batch.outcome import Outcome
from thsa_cosim.errors import ParameterError, did_you_mean
from thsa_cosim.fmu.description import FmuDescription

OnOutcome = Callable[[int, Outcome], None]
"""Called with a job's index and its outcome, in order of completion, in the caller's thread."""


class TimeIsOver(Exception):
    """The time after which a runner begins no further job; ``outcomes``: of the jobs that had ended."""

    def __init__(self, outcomes: Sequence[Outcome] = ()) -> None:
        super().__init__("the time for these runs is over")
        self.outcomes = tuple(outcomes)


class Runner(Protocol):
    """Runs batches of jobs; a context manager."""

    notes: Sequence[str]
    """Findings about its FMUs from the code that opened it, one sentence each."""

    def run(self, jobs: Sequence[Job], on_outcome: OnOutcome | None = None) -> list[Outcome]:
        """Run all jobs; outcomes come in the order of the jobs, whatever the number of workers.

        Raises ParameterError for a job that names an unknown experiment or variable, before any is run.
        """
        ...

    def close(self) -> None:
        """Stop the workers and remove their folders."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def by_name(experiments: Sequence[Experiment]) -> dict[str, Experiment]:
    """Index experiments by name; ParameterError if two share one."""
    named: dict[str, Experiment] = {}
    for experiment in experiments:
        if experiment.name in named:
            raise ParameterError(f"Two experiments are named {experiment.name!r}; give each its own name.")
        named[experiment.name] = experiment
    return named


def wrapper_names(experiments: Sequence[Experiment]) -> dict[str, frozenset[str]]:
    """Names of the wrappers' parameters by experiment, for ``check_jobs``."""
    return {e.name: e.wrapper_names for e in experiments if e.wrapper is not None}


def check_experiment(experiment: Experiment, description: FmuDescription) -> None:
    """FmuError or ParameterError if an experiment names variables that its FMU lacks."""
    from thsa_cosim.fmu.inputs import communication_grid, input_variables
    from thsa_cosim.fmu.texts import check_texts

    own = experiment.wrapper_names
    for name in (*experiment.outputs, *(n for n in experiment.fixed if n not in own)):
        description.variable(name)
    check_texts(experiment.texts, description)
    input_variables(description, experiment.inputs)
    communication_grid(experiment.time)


def check_jobs(
    jobs: Sequence[Job],
    descriptions: Mapping[str, FmuDescription | None],
    wrapped: Mapping[str, frozenset[str]] | None = None,
) -> None:
    """ParameterError or FmuError for the first job with an unknown experiment or variable.

    ``wrapped``: names that belong to an experiment's wrapper, by experiment.
    """
    seen: set[tuple[str, tuple[str, ...]]] = set()
    for job in jobs:
        key = (job.experiment, tuple(job.values))
        if key in seen:
            continue
        if job.experiment not in descriptions:
            hint = did_you_mean(job.experiment, descriptions)
            raise ParameterError(f"There is no experiment {job.experiment!r}.{hint}")
        description = descriptions[job.experiment]
        if description is not None:
            own = (wrapped or {}).get(job.experiment, frozenset())
            for name in job.values:
                if name not in own:
                    description.variable(name)
        seen.add(key)
