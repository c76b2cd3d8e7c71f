"""The command line: arguments in, exit codes out. Heavy modules are imported by the command that needs them.

Exit codes: 0 done, 2 bad input (one sentence on stderr), 3 the study ran but has no usable result,
130 interrupted. Set THSA_COSIM_DEBUG=1 to see the traceback of an error.
"""

import datetime
import json
import os
import shlex
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict

import click

from thsa_cosim import __version__
from thsa_cosim.errors import InputError, StudyError, ThsaCosimError

if TYPE_CHECKING:
    from rich.console import Console

    from thsa_cosim.identify import Progress
    from thsa_cosim.scenario import Scenario, StagedScenario
    from thsa_cosim.ssv import ParameterSet

PATH = click.Path(path_type=Path)


class _Cli(click.Group):
    """A group whose errors are single sentences."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        from thsa_cosim.errors import did_you_mean

        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            known = self.list_commands(ctx)
            hint = did_you_mean(args[0], known) or f" Known commands: {', '.join(known)}."
            raise click.UsageError(f"There is no command {args[0]!r}.{hint}", ctx) from error


@click.group(cls=_Cli, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="thsa-cosim")
def cli() -> None:
    """Identify and tune electromechanical actuators on FMUs, from Modelica models and bench recordings."""


@cli.command()
@click.argument("model")
@click.option(
    "--package", type=PATH, default=Path("modelica/THSA"), show_default=True, help="Folder of the package."
)
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="FMI version.")
@click.option("-o", "--output", type=PATH, default=None, help="The FMU to write; default MODEL.fmu.")
@click.option(
    "--compiler",
    type=click.Choice(["native", "omc"]),
    default="native",
    show_default=True,
    help="Exporter: ours, or OpenModelica.",
)
@click.option("--platforms", default=None, help="Comma-separated FMI platforms, for example win64,linux64.")
def export(
    model: str, package: Path, fmi: str, output: Path | None, compiler: str, platforms: str | None
) -> None:
    """Export the Modelica class MODEL (or a .mo file's class) as an FMU."""
    from thsa_cosim.export import export_fmu

    chosen = None if platforms is None else [part.strip() for part in platforms.split(",") if part.strip()]
    path = export_fmu(
        model, package=package, fmi=int(fmi), output=output, compiler=compiler, platforms=chosen
    )
    click.echo(str(path))


@cli.command()
@click.argument("fmu", type=PATH)
@click.option("--json", "as_json", is_flag=True, help="Print the findings as JSON.")
def check(fmu: Path, as_json: bool) -> None:
    """Say what an FMU is and what it can be trusted with."""
    from thsa_cosim.check import check_fmu

    report = check_fmu(fmu)
    if as_json:
        click.echo(json.dumps(report.to_dict(), indent=2))
    else:
        from thsa_cosim.report.check import print_check

        print_check(_console(), report)


def _study_options(command: Callable[..., None]) -> Callable[..., None]:
    """Options that the study commands share, in the order in which help shows them."""
    options = [
        click.option(
            "--fit", type=PATH, multiple=True, help="A recording to fit, instead of the scenario's."
        ),
        click.option("--validate", type=PATH, multiple=True, help="A recording to hold out, likewise."),
        click.option(
            "-o", "--output", type=PATH, default=None, help="Study folder; an existing one is continued."
        ),
        click.option(
            "--seed", type=click.IntRange(min=0), default=None, help="Seed instead of the scenario's."
        ),
        click.option("--fmu", type=PATH, default=None, help="FMU instead of the scenario's."),
        click.option(
            "--workers", type=click.IntRange(min=1), default=None, help="Processes; default: all cores."
        ),
        click.option(
            "--cluster", default=None, help="Address of a Dask scheduler instead of local processes."
        ),
        click.option("--quiet", "-q", is_flag=True, help="Print nothing but errors."),
        click.option("--json", "as_json", is_flag=True, help="Print result.json instead of tables."),
    ]
    for option in reversed(options):
        command = option(command)
    return command


@cli.command()
@click.argument("scenario", type=PATH)
@_study_options
@click.option(
    "--export-fmu/--no-export-fmu",
    default=None,
    help="Write the FMU anew with what was identified; default: only of a scenario with stages.",
)
def identify(
    scenario: Path,
    fit: tuple[Path, ...],
    validate: tuple[Path, ...],
    output: Path | None,
    seed: int | None,
    fmu: Path | None,
    workers: int | None,
    cluster: str | None,
    quiet: bool,
    as_json: bool,
    export_fmu: bool | None,
) -> None:
    """Identify parameters from recordings as SCENARIO says, point by point over temperature."""
    from thsa_cosim.report.parameter_files import write_identified_fmu
    from thsa_cosim.report.progress import ProgressDisplay
    from thsa_cosim.report.study import RESULT
    from thsa_cosim.scenario import Scenario, StagedScenario, load_study

    loaded = load_study(scenario, fit=fit, validate=validate, seed=seed, fmu=fmu)
    _check_kind(scenario, loaded.kind, "identify")
    folder = output or default_folder(scenario)
    with ProgressDisplay(_console(stderr=True), quiet=quiet) as display:
        options: _RunOptions = {
            "folder": folder,
            "workers": workers or cores(),
            "cluster": cluster,
            "on_progress": display,
        }
        finish = _identify_one(loaded, options) if isinstance(loaded, Scenario) else _stages(loaded, options)
    files, status, parameters, show = finish
    if status == "interrupted":
        raise _Interrupted(_continue_command("identify", scenario, folder))
    note = ""
    if export_fmu or (export_fmu is None and isinstance(loaded, StagedScenario)):
        target = loaded.stages[-1].scenario.fmu if isinstance(loaded, StagedScenario) else loaded.fmu
        try:
            files.append(write_identified_fmu(folder, target, parameters))
        except ThsaCosimError as error:
            if export_fmu:
                raise
            note = f"note: no FMU with the identified values was written: {error}"
    if as_json:
        click.echo((folder / RESULT).read_text(encoding="utf-8"), nl=False)
    elif not quiet:
        console = _console()
        show(console)
        if note:
            console.print(note, highlight=False, markup=False, soft_wrap=True)
        console.print(
            f"\n{len(files)} files in {folder}; the numbers are in {folder / RESULT}", soft_wrap=True
        )


class _RunOptions(TypedDict):
    folder: Path
    workers: int
    cluster: str | None
    on_progress: Callable[["Progress"], None]


_Finished = tuple[list[Path], str, "ParameterSet", Callable[["Console"], None]]


def _identify_one(scenario: "Scenario", options: _RunOptions) -> _Finished:
    from thsa_cosim.identify import identify as run
    from thsa_cosim.report.study import write_identify
    from thsa_cosim.report.tables import print_identify

    result = run(scenario, **options)
    files = write_identify(result, options["folder"])
    return files, result.status, result.parameter_set, lambda console: print_identify(console, result)


def _stages(staged: "StagedScenario", options: _RunOptions) -> _Finished:
    from thsa_cosim.report.staged import print_staged, write_staged
    from thsa_cosim.staged import run_stages

    result = run_stages(staged, **options)
    files = write_staged(result, options["folder"])
    return files, result.status, result.parameter_set, lambda console: print_staged(console, result)


@cli.command()
@click.argument("scenario", type=PATH)
@_study_options
def tune(
    scenario: Path,
    fit: tuple[Path, ...],
    validate: tuple[Path, ...],
    output: Path | None,
    seed: int | None,
    fmu: Path | None,
    workers: int | None,
    cluster: str | None,
    quiet: bool,
    as_json: bool,
) -> None:
    """Tune gains for the commands and conditions that SCENARIO describes; schedule them if it asks."""
    from thsa_cosim.report.progress import ProgressDisplay
    from thsa_cosim.report.study import RESULT
    from thsa_cosim.report.tune_study import print_tune, write_tune
    from thsa_cosim.scenario import load_tune
    from thsa_cosim.tune import tune as run

    if fit or validate:
        raise InputError(
            f"{scenario}: a tuning describes its command itself; leave out --fit and --validate."
        )
    loaded = load_tune(scenario, seed=seed, fmu=fmu)
    folder = output or default_folder(scenario)
    with ProgressDisplay(_console(stderr=True), quiet=quiet) as display:
        result = run(loaded, folder=folder, workers=workers or cores(), cluster=cluster, on_progress=display)
        files = write_tune(result, folder)
    if result.status == "interrupted":
        raise _Interrupted(_continue_command("tune", scenario, folder))
    if as_json:
        click.echo((folder / RESULT).read_text(encoding="utf-8"), nl=False)
    elif not quiet:
        console = _console()
        print_tune(console, result)
        console.print(
            f"\n{len(files)} files in {folder}; the numbers are in {folder / RESULT}", soft_wrap=True
        )
    if result.after is None or not result.after.feasible:
        raise StudyError(f"{scenario}: no gains within the bounds keep every hard requirement.")


@cli.command()
@click.argument("scenario", type=PATH)
@_study_options
def simulate(
    scenario: Path,
    fit: tuple[Path, ...],
    validate: tuple[Path, ...],
    output: Path | None,
    seed: int | None,
    fmu: Path | None,
    workers: int | None,
    cluster: str | None,
    quiet: bool,
    as_json: bool,
) -> None:
    """Run SCENARIO once per recording and compare; parameters to be identified keep their start values."""
    from thsa_cosim.identify import open_study, study_identity
    from thsa_cosim.report.tables import print_simulate
    from thsa_cosim.scenario import load_scenario
    from thsa_cosim.simulate import RESULT
    from thsa_cosim.simulate import simulate as run

    loaded = load_scenario(scenario, fit=fit, validate=validate, seed=seed, fmu=fmu)
    folder = output or default_folder(scenario, "" if loaded.kind == "simulate" else "-simulate")
    open_study(folder, {**study_identity(loaded), "kind": "simulate"})
    result = run(loaded, folder=folder, workers=workers or cores(), cluster=cluster)
    if as_json:
        click.echo((folder / RESULT).read_text(encoding="utf-8"), nl=False)
    elif not quiet:
        console = _console()
        print_simulate(console, result)
        console.print(f"\n{len(result.files)} files in {folder}", soft_wrap=True)


class _Interrupted(Exception):
    """A study was interrupted and has written what it has."""


def cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def default_folder(scenario: Path, suffix: str = "") -> Path:
    """``studies/<scenario>-<date>``: the same command on the same day continues the same study."""
    return Path("studies") / f"{scenario.stem}{suffix}-{datetime.date.today().isoformat()}"


def _continue_command(command: str, scenario: Path, folder: Path) -> str:
    """The command line as it was given, with the study folder spelt out."""
    arguments = list(sys.argv[1:]) or [command, str(scenario)]
    if not any(a in ("-o", "--output") or a.startswith(("-o", "--output=")) for a in arguments):
        arguments += ["-o", str(folder)]
    return shlex.join(["thsa-cosim", *arguments])


def _check_kind(scenario: Path, kind: str, wanted: str) -> None:
    if kind != wanted:
        raise InputError(f"{scenario} is a scenario of kind {kind!r}: run 'thsa-cosim {kind} {scenario}'.")


def _console(*, stderr: bool = False) -> "Console":
    from rich.console import Console

    console = Console(stderr=stderr)
    # A pipe has no width; 80 columns would fold every table.
    return console if console.is_terminal else Console(stderr=stderr, width=140)


def main() -> None:
    """Entry point: run a command and leave with its exit code."""
    sys.exit(run_command(sys.argv[1:]))


def run_command(arguments: list[str]) -> int:
    """Run one command line; return its exit code. Errors become one sentence on stderr."""
    try:
        code = cli.main(args=arguments, prog_name="thsa-cosim", standalone_mode=False)
        return code if isinstance(code, int) else 0
    except click.exceptions.Exit as exit_:
        return exit_.exit_code
    except click.ClickException as error:
        return _fail(error.format_message(), 2)
    except ThsaCosimError as error:
        return _fail(str(error), error.exit_code)
    except _Interrupted as interruption:
        return _fail(f"interrupted; what is done is kept, continue with: {interruption}", 130, label=False)
    except (KeyboardInterrupt, click.Abort):
        return _fail("interrupted; the same command starts again, or continues its study.", 130, label=False)
    except BrokenPipeError:
        # Whoever read our output has left; nothing may be written on the way out either.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        where = f" ({error.filename})" if error.filename else ""
        return _fail(f"{error.strerror or error}{where}.", 2)
    except Exception as error:
        detail = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        return _fail(f"internal fault, please report it: {detail} (THSA_COSIM_DEBUG=1 shows where).", 3)


def _fail(sentence: str, code: int, *, label: bool = True) -> int:
    if os.environ.get("THSA_COSIM_DEBUG"):
        traceback.print_exc()
    text = " ".join(sentence.split())
    click.echo(f"error: {text}" if label else text, err=True)
    return code


if __name__ == "__main__":
    main()
