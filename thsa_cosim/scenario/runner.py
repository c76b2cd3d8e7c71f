"""From a scenario's ``[simulation]`` to the processes that run it."""

from collections.abc import Sequence
from dataclasses import replace

from thsa_cosim.batch import Experiment, LocalRunner, Runner
from thsa_cosim.scenario.handling import settle_handling
from thsa_cosim.scenario.model import SimulationSpec


def open_runner(
    spec: SimulationSpec, experiments: Sequence[Experiment], workers: int, cluster: str | None
) -> Runner:
    """Return ``workers`` local processes, or those of the Dask scheduler at the address ``cluster``.

    How a foreign FMU is given its inputs is settled first, by a trial where the scenario does not say it; the
    runner's ``notes`` say what was found.

    Raises
    ------
    ParameterError, FmuError
        If an experiment names variables that its FMU does not have.
    MissingExtraError, StudyError
        If Dask is not installed, or no scheduler answers.
    """
    settled = settle_handling(spec, experiments)
    chosen = [
        replace(e, input_mode=mode) if mode is not None else e
        for e, mode in zip(experiments, settled.modes, strict=True)
    ]
    runner: Runner
    if cluster is not None:
        from thsa_cosim.batch.cluster import ClusterRunner  # Dask is an extra

        runner = ClusterRunner(
            chosen,
            cluster,
            deadline_s=spec.deadline,
            memory_limit_mb=spec.memory_mb,
            reuse=spec.reuse,
            stepping=spec.stepping,
            kind=settled.interface,
        )
    else:
        runner = LocalRunner(
            chosen,
            workers=workers,
            deadline_s=spec.deadline,
            memory_limit_mb=spec.memory_mb,
            reuse=spec.reuse,
            stepping=spec.stepping,
            kind=settled.interface,
        )
    runner.notes = settled.notes
    return runner
