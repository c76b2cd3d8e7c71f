"""A study that runs: its place, claimed for what was asked, and the log of its runs."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from thsa_cosim.batch import Experiment, Runner
from thsa_cosim.scenario import SimulationTable
from thsa_cosim.study.folder import claim_folder
from thsa_cosim.study.identity import Identity
from thsa_cosim.study.place import Place
from thsa_cosim.study.runs import RUNS, LoggedRunner, RunLog


class Study:
    """The one who works in a study folder; a context manager.

    Every simulation goes through :meth:`open_runner`, so that every kind of study continues run by run.
    """

    def __init__(self, place: Place, log: RunLog) -> None:
        """``Study.open`` is the way in."""
        self.place = place
        self._log = log

    @classmethod
    def open(cls, place: Place, identity: Identity, about: Mapping[str, object]) -> "Study":
        """Claim the folder for what is asked; what it holds of the same study is continued.

        Raises
        ------
        InputError
            If the folder belongs to another study or to another run, or cannot be used.
        """
        claim_folder(place.folder, identity, {**about, "command": place.command} if place.command else about)
        return cls(place, RunLog.open(place.folder / RUNS, place.say))

    @property
    def folder(self) -> Path:
        """The study folder."""
        return self.place.folder

    @property
    def recalled(self) -> int:
        """Runs that were taken from the log so far."""
        return self._log.recalled

    def open_runner(self, spec: SimulationTable, experiments: Sequence[Experiment]) -> Runner:
        """Open the processes for ``experiments``; their outcomes are kept, and looked up."""
        # Deadline and memory decide whether a run is let finish, not what it gives.
        settings = sorted(spec.model_dump(exclude={"deadline", "memory"}).items())
        return LoggedRunner(
            self.place.executor.open_runner(spec, experiments), self._log, experiments, settings
        )

    def complete(self) -> None:
        """The result is complete: nothing has to be looked up any more."""
        self._log.remove()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._log.close()
