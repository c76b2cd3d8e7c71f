"""Where a study is kept, where it runs and whom it tells: one object instead of five arguments."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from thsa_cosim.scenario import Executor


@dataclass(frozen=True)
class Progress:
    """How far a study is: a step that begins (``planned`` is 0), or a search and its runs.

    ``runs`` counts simulations (evaluated vector × recording), ``reused`` those taken from the journal; ``planned``
    shrinks when a search converges early. ``best``: lowest cost per sample so far, by point.
    """

    stage: str
    runs: int = 0
    planned: int = 0
    reused: int = 0
    failures: int = 0
    best: Mapping[str, float] = field(default_factory=dict)
    generation: int = 0


OnProgress = Callable[[Progress], None]


@dataclass(frozen=True)
class Place:
    """``folder`` keeps the study, ``executor`` runs it, ``on_progress`` is told, ``command`` repeats it."""

    folder: Path
    executor: Executor = field(default_factory=Executor)
    on_progress: OnProgress | None = None
    command: str = ""
    """Empty for a study that a script runs."""

    def tell(self, progress: Progress) -> None:
        """Tell how far the study is, if somebody wants to know."""
        if self.on_progress is not None:
            self.on_progress(progress)

    def say(self, step: str) -> None:
        """Tell that a step begins."""
        self.tell(Progress(step))

    def stage(self, name: str, label: str) -> "Place":
        """The place of a stage: a folder inside, whose progress is told under ``label``."""
        tell = None if self.on_progress is None else (lambda p: self.tell(replace(p, stage=label)))
        return replace(self, folder=self.folder / name, on_progress=tell, command="")
