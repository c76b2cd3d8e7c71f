"""How far a study is, while it runs: a bar on a terminal, now and then a plain line elsewhere."""

import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.console import Console
from rich.progress import BarColumn, TaskID, TextColumn
from rich.progress import Progress as Bar

if TYPE_CHECKING:
    from thsa_cosim.study import Progress

#: Seconds between two plain lines.
LINE_EVERY = 10.0
#: Seconds between two updates of the bar.
BAR_EVERY = 0.1


class _Console(Console):
    """A console that leaves it to the command what becomes of it when its reader has left."""

    def on_broken_pipe(self) -> None:
        # rich would end the process with exit code 1, although the study is complete.
        self.quiet = True
        raise BrokenPipeError


def console(*, stderr: bool = False) -> Console:
    """A console for stdout or stderr; in a pipe it is plain and wide."""
    found = _Console(stderr=stderr)
    # A pipe has no width; 80 columns would fold every table.
    return found if found.is_terminal else _Console(stderr=stderr, width=140)


class ProgressDisplay:
    """A context manager that is called with every ``Progress``; ``quiet`` shows nothing at all.

    A step that begins is shown at once, with the seconds since the beginning; how far a search is now and then.
    """

    def __init__(self, console: Console, *, quiet: bool = False) -> None:
        self._console = console
        self._quiet = quiet
        self._bar: Bar | None = None
        self._task: TaskID | None = None
        self._start = self._begin = time.monotonic()
        self._shown = self._begin
        self._last: Progress | None = None
        self._said = ""

    def __enter__(self) -> Self:
        if not self._quiet and self._console.is_terminal:
            self._bar = Bar(
                TextColumn("{task.description}"),
                BarColumn(bar_width=24),
                TextColumn("{task.fields[state]}"),
                console=self._console,
                transient=True,
            )
            self._bar.start()
            self._task = self._bar.add_task("starting", total=None, state="")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()
        elif not self._quiet and self._last is not None:
            self._line(self._last)

    def __call__(self, progress: "Progress") -> None:
        """Show ``progress``, unless something was shown a moment ago."""
        if not progress.planned:
            self._step(progress.stage)
            return
        now = time.monotonic()
        if self._last is None or progress.stage != self._last.stage:
            self._begin = now  # rate and time left are those of the stage
        self._last = progress
        if self._quiet or now - self._shown < (LINE_EVERY if self._bar is None else BAR_EVERY):
            return
        self._shown = now
        if self._bar is None:
            self._line(progress)
        elif self._task is not None:
            self._bar.update(
                self._task,
                description=progress.stage,
                completed=progress.runs,
                total=progress.planned,
                state=self._state(progress),
            )

    def _step(self, step: str) -> None:
        if step == self._said and self._bar is None:
            return  # a line more says nothing new
        self._said = step
        text = f"{time.monotonic() - self._start:6.1f} s  {step}"
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=text, state="")
        elif not self._quiet:
            self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    def _line(self, progress: "Progress") -> None:
        text = f"{progress.stage}: {self._state(progress)}"
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    def _state(self, progress: "Progress") -> str:
        elapsed = max(time.monotonic() - self._begin, 1e-3)
        rate = (progress.runs - progress.reused) / elapsed
        parts = [f"{progress.runs}/{progress.planned} runs"]
        if progress.reused:
            parts.append(f"{progress.reused} from the journal")
        if rate > 0.0:
            parts.append(f"{rate:.0f} runs/s" if rate >= 1.0 else f"{60.0 * rate:.1f} runs/min")
            left = max(progress.planned - progress.runs, 0) / rate
            parts.append(f"{duration(left)} left")
        if progress.best:
            parts.append(f"best cost {min(progress.best.values()):.3g} to {max(progress.best.values()):.3g}")
        parts.append(f"{progress.failures} failed")
        return ", ".join(parts)


def duration(seconds: float) -> str:
    """A short time such as ``42 s``, ``3 min 20 s`` or ``2 h 5 min``."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
