"""What the study commands share: their options, where a study goes, and how it ends."""

import functools
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec

import click

from thsa_cosim.errors import StudyError, ThsaCosimError

if TYPE_CHECKING:
    from rich.console import Console

    from thsa_cosim.api.conduct import Asked, Conducted

PATH = click.Path(path_type=Path)

P = ParamSpec("P")


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

    def ask(self, command: str, package: Path | None = None) -> "Asked":
        """Load the scenario for ``command``; nothing is written yet."""
        from thsa_cosim.api.conduct import ask

        return ask(
            command,
            self.scenario,
            folder=self.output,
            fit=self.fit,
            validate=self.validate,
            seed=self.seed,
            fmu=self.fmu,
            package=package,
            workers=self.workers,
            cluster=self.cluster,
            repeat=lambda folder: self.repeat(command, folder, package),
        )

    def conduct(self, asked: "Asked") -> "Conducted":
        """Conduct the study and write its page, unless that was declined; Interrupted if it was cut short."""
        from thsa_cosim.api.conduct import conduct

        go_on = f"finished runs are kept, continue with: {asked.place.command}"
        try:
            done = conduct(asked, quiet=self.quiet)
        except KeyboardInterrupt:
            from thsa_cosim.report.files import RESULT
            from thsa_cosim.study import MARKER

            folder = asked.place.folder
            if not (folder / MARKER).exists() or (folder / RESULT).exists():
                raise  # nothing has begun, or all is there
            raise Interrupted(
                f"interrupted before there was a result ({folder} holds no {RESULT}); {go_on}"
            ) from None
        done = replace(done, files=(*done.files, *self.page(done.folder)))
        if done.status == "interrupted":
            raise Interrupted(f"interrupted; {go_on}")
        return done

    def repeat(self, command: str, folder: Path, package: Path | None = None) -> str:
        """The command line that repeats the study, or continues it, with its folder spelt out."""
        words = ["thsa-cosim", command, str(self.scenario)]
        for option, given in (("--fit", self.fit), ("--validate", self.validate)):
            words += [word for path in given for word in (option, str(path))]
        others = {
            "--seed": self.seed,
            "--fmu": self.fmu,
            "--workers": self.workers,
            "--cluster": self.cluster,
            "--package": package,
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

    def conclude(self, done: "Conducted", note: str = "") -> None:
        """Print result.json, or tables and where the files are, or nothing; StudyError if the result is of no use."""
        from thsa_cosim.report.files import RESULT

        result = done.folder / RESULT
        if self.as_json:
            click.echo(result.read_text(encoding="utf-8"), nl=False)
        elif not self.quiet:
            out = console()
            done.show(out)
            if note:
                out.print(note, highlight=False, markup=False, soft_wrap=True)
            page = done.folder / "report.html"
            shown = f"; open {page}" if page.exists() else ""
            out.print(
                f"\n{len(set(done.files))} files in {done.folder}{shown}; the numbers are in {result}",
                soft_wrap=True,
            )
        if done.objection:
            raise StudyError(done.objection)


_OPTIONS = (
    click.argument("scenario", type=PATH),
    click.option(
        "--fit",
        type=PATH,
        multiple=True,
        help="A recording to fit, in place of the scenario's; may be repeated.",
    ),
    click.option(
        "--validate",
        type=PATH,
        multiple=True,
        help="A recording to hold out, in place of the scenario's; may be repeated.",
    ),
    click.option(
        "-o", "--output", type=PATH, default=None, help="Study folder; an existing one is continued."
    ),
    click.option(
        "--seed", type=click.IntRange(min=0), default=None, help="Seed, in place of the scenario's."
    ),
    click.option("--fmu", type=PATH, default=None, help="FMU, in place of the scenario's."),
    click.option(
        "--workers",
        type=click.IntRange(min=1),
        default=None,
        help="Number of worker processes; default: all cores.",
    ),
    click.option("--cluster", default=None, help="Address of a Dask scheduler, to run on several machines."),
    click.option("--quiet", "-q", is_flag=True, help="Print errors only."),
    click.option("--json", "as_json", is_flag=True, help="Print result.json, not tables."),
    click.option("--report/--no-report", default=True, show_default=True, help="Write the page report.html."),
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
    """A study was interrupted and has kept what it has; the message says so, with the command that continues it."""


def console(*, stderr: bool = False) -> "Console":
    """Return a console for stdout or stderr; in a pipe it is plain and wide."""
    from thsa_cosim.report.progress import console as open_console  # rich takes its time to import

    return open_console(stderr=stderr)
