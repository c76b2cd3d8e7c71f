"""From a scenario's ``[simulation]`` to the processes that run it."""

from collections.abc import Sequence

from thsa_cosim.batch import Experiment, LocalRunner, Runner
from thsa_cosim.scenario.model import SimulationSpec


def open_runner(
    spec: SimulationSpec, experiments: Sequence[Experiment], workers: int, cluster: str | None
) -> Runner:
    """Return ``workers`` local processes, or those of the Dask scheduler at the address ``cluster``.

    Raises
    ------
    ParameterError, FmuError
        If an experiment names variables that its FMU does not have.
    MissingExtraError, StudyError
        If Dask is not installed, or no scheduler answers.
    """
    if cluster is not None:
        from thsa_cosim.batch.cluster import ClusterRunner  # Dask is an extra

        return ClusterRunner(
            experiments,
            cluster,
            deadline_s=spec.deadline,
            memory_limit_mb=spec.memory_mb,
            reuse=spec.reuse,
            kind=spec.interface,
        )
    return LocalRunner(
        experiments,
        workers=workers,
        deadline_s=spec.deadline,
        memory_limit_mb=spec.memory_mb,
        reuse=spec.reuse,
        kind=spec.interface,
    )
