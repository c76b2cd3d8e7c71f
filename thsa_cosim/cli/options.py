"""What the study commands share: their options, where a study goes, and how it ends."""

import functools
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypedDict

import click

from thsa_cosim.api import cores, default_folder
from thsa_cosim.errors import InputError, ThsaCosimError

if TYPE_CHECKING:
    from rich.console import Console

    from thsa_cosim.scenario import Scenario

PATH = click.Path(path_type=Path)

P = ParamSpec("P")


class Overrides(TypedDict):
    """What the command line replaces in a scenario: keyword arguments of its loader."""

    fit: tuple[Path, ...]
    validate: tuple[Path, ...]
    seed: int | None
    fmu: Path | None


class Place(TypedDict):
    """Where a study runs and is kept: keyword arguments of the use cases."""

    folder: Path
    workers: int
    cluster: str | None


@dataclass(frozen=True)
class StudyOptions:
    """The arguments of a study command as they were given."""

    scenario: Path
    fit: tuple[Path, ...]
    validate: tuple[Path, ...]
    output: Path | None
    seed: int | None
    fmu: Path | None
    workers: int | None
    cluster: str | None
    quiet: bool
    as_json: bool
    report: bool

    @property
    def overrides(self) -> Overrides:
        """What replaces the scenario's own recordings, seed and FMU."""
        return {"fit": self.fit, "validate": self.validate, "seed": self.seed, "fmu": self.fmu}

    def place(self, suffix: str = "") -> Place:
        """Return folder, workers and cluster, with their defaults; ``suffix`` goes into the folder's."""
        return {
            "folder": self.output or default_folder(self.scenario, suffix),
            "workers": self.workers or cores(),
            "cluster": self.cluster,
        }

    def repeat(self, command: str, folder: Path) -> str:
        """The command line that repeats the study, or continues it, with its folder spelt out."""
        words = ["thsa-cosim", command, str(self.scenario)]
        for option, given in (("--fit", self.fit), ("--validate", self.validate)):
            words += [word for path in given for word in (option, str(path))]
        others = {
            "--seed": self.seed,
            "--fmu": self.fmu,
            "--workers": self.workers,
            "--cluster": self.cluster,
        }
        for option, value in others.items():
            words += [] if value is None else [option, str(value)]
        return shlex.join([*words, "-o", str(folder)])

    def page(self, folder: Path) -> list[Path]:
        """Write the study's page unless that was declined; a disk that refuses it does not fail the study."""
        from thsa_cosim.report.page import write_page

        if not self.report:
            return []
        try:
            return [write_page(folder)]
        except ThsaCosimError as error:
            click.echo(f"note: no page was written: {error}", err=True)
            return []

    def show_data(self, *scenarios: "Scenario") -> None:
        """Print on stderr, one line each, what is wrong with the recordings, before anything is searched."""
        from thsa_cosim.report.inspection import print_inspection

        if self.quiet:
            return
        out = console(stderr=True)
        for scenario in scenarios:
            print_inspection(out, scenario.data, notes=False)

    def check_kind(self, kind: str, wanted: str) -> None:
        """InputError, with the command to use, if the scenario is of another kind."""
        if kind != wanted:
            raise InputError(
                f"{self.scenario} is a scenario of kind {kind!r}: run 'thsa-cosim {kind} {self.scenario}'."
            )

    def conclude(self, result: Path, files: int, show: Callable[["Console"], None]) -> None:
        """Print result.json at ``result``, or what ``show`` prints and where the files are, or nothing."""
        if self.as_json:
            click.echo(result.read_text(encoding="utf-8"), nl=False)
        elif not self.quiet:
            out = console()
            show(out)
            out.print(f"\n{files} files in {result.parent}; the numbers are in {result}", soft_wrap=True)


_OPTIONS = (
    click.argument("scenario", type=PATH),
    click.option("--fit", type=PATH, multiple=True, help="A recording to fit, instead of the scenario's."),
    click.option("--validate", type=PATH, multiple=True, help="A recording to hold out, likewise."),
    click.option(
        "-o", "--output", type=PATH, default=None, help="Study folder; an existing one is continued."
    ),
    click.option("--seed", type=click.IntRange(min=0), default=None, help="Seed instead of the scenario's."),
    click.option("--fmu", type=PATH, default=None, help="FMU instead of the scenario's."),
    click.option(
        "--workers", type=click.IntRange(min=1), default=None, help="Processes; default: all cores."
    ),
    click.option("--cluster", default=None, help="Address of a Dask scheduler instead of local processes."),
    click.option("--quiet", "-q", is_flag=True, help="Print nothing but errors."),
    click.option("--json", "as_json", is_flag=True, help="Print result.json instead of tables."),
    click.option("--report/--no-report", default=True, show_default=True, help="Write report.html as well."),
)
"""In the order in which help shows them."""


def study_options(command: Callable[Concatenate[StudyOptions, P], None]) -> Callable[..., None]:
    """Give a command the scenario argument and all shared options, gathered in its first parameter."""

    @functools.wraps(command)
    def gathered(*args: P.args, **given: P.kwargs) -> None:
        values: Mapping[str, Any] = given
        shared = {name: values[name] for name in StudyOptions.__dataclass_fields__}
        own: Any = {name: value for name, value in values.items() if name not in shared}
        command(StudyOptions(**shared), *args, **own)

    decorated: Callable[..., None] = gathered
    for option in reversed(_OPTIONS):
        decorated = option(decorated)
    return decorated


class Interrupted(Exception):
    """A study was interrupted and has written what it has; the message is the command that continues it."""


def console(*, stderr: bool = False) -> "Console":
    """Return a console for stdout or stderr; in a pipe it is plain and wide."""
    from thsa_cosim.report.progress import console as open_console  # rich takes its time to import

    return open_console(stderr=stderr)
