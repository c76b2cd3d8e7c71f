"""Where simulations run: local processes, or what answers at an address.

To add an executor: a class like ``batch.local.LocalRunner`` in ``thsa_cosim/batch``, and a row in ``BY_SCHEME``.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from thsa_cosim.batch import Experiment, LocalRunner, Runner
from thsa_cosim.scenario.handling import settle
from thsa_cosim.scenario.schema import SimulationTable

OpenRunner = Callable[[SimulationTable, Sequence[Experiment]], Runner]
"""Opens processes for experiments, as ``[simulation]`` wants them."""
Opening = Callable[[Sequence[Experiment]], Runner]
"""The same where ``[simulation]`` is settled."""


def _dask(experiments: Sequence[Experiment], address: str, **limits: Any) -> Runner:
    from thsa_cosim.batch.cluster import ClusterRunner  # Dask is an extra

    runner: Runner = ClusterRunner(experiments, address, **limits)
    return runner


#: What is behind an address, by its scheme; without one (``host:8786``) it is a Dask scheduler.
BY_SCHEME: Mapping[str, Callable[..., Runner]] = {"": _dask, "tcp": _dask, "tls": _dask}


@dataclass(frozen=True)
class Executor:
    """``workers`` processes of this machine, or those behind the ``address`` of a cluster."""

    workers: int = 1
    address: str | None = None

    def open_runner(self, spec: SimulationTable, experiments: Sequence[Experiment]) -> Runner:
        """Open the processes.

        How a foreign FMU is given its inputs is settled first, by a trial where the scenario does not say it, and
        whether its runs may share a process; the runner's ``notes`` say what was found.

        Raises
        ------
        ParameterError, FmuError
            If an experiment names variables that its FMU does not have.
        MissingExtraError, StudyError
            If Dask is not installed, or no scheduler answers.
        """
        settled = settle(spec, experiments)
        chosen = [
            replace(e, input_mode=mode) if mode is not None else e
            for e, mode in zip(experiments, settled.modes, strict=True)
        ]
        limits: dict[str, Any] = {
            "deadline_s": spec.deadline,
            "memory_limit_mb": spec.memory,
            "reuse": spec.reuse,
            "stepping": spec.stepping,
            "kind": settled.interface,
            **settled.limits,
        }
        if self.address is None:
            return _noted(LocalRunner(chosen, workers=self.workers, **limits), settled.notes)
        scheme = self.address.partition("://")[0] if "://" in self.address else ""
        opened = BY_SCHEME[scheme if scheme in BY_SCHEME else ""](chosen, self.address, **limits)
        return _noted(opened, settled.notes)


def _noted(runner: Runner, notes: Sequence[str]) -> Runner:
    runner.notes = notes
    return runner
