"""The command ``identify``: one scenario, or several in stages."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from thsa_cosim.cli.dry_run import dry_run_option, show_forecast
from thsa_cosim.cli.options import Interrupted, Place, StudyOptions, console, study_options
from thsa_cosim.errors import ThsaCosimError

if TYPE_CHECKING:
    from rich.console import Console

    from thsa_cosim.identify import Progress
    from thsa_cosim.scenario import Scenario, StagedScenario
    from thsa_cosim.ssv import ParameterSet


@click.command()
@study_options
@click.option(
    "--export-fmu/--no-export-fmu",
    default=None,
    help="Write the FMU anew with what was identified; default: only of a scenario with stages.",
)
@dry_run_option
def identify(options: StudyOptions, export_fmu: bool | None, dry_run: bool) -> None:
    """Identify parameters from recordings as SCENARIO says, point by point over temperature."""
    from thsa_cosim.report.files import RESULT
    from thsa_cosim.report.parameter_files import write_identified_fmu
    from thsa_cosim.report.progress import ProgressDisplay
    from thsa_cosim.scenario import Scenario, load_study

    loaded = load_study(options.scenario, **options.overrides)
    if loaded.kind != "diagnose":  # its parameters can be identified as they are
        options.check_kind(loaded.kind, "identify")
    options.show_data(*(s.scenario for s in loaded.stages) if not isinstance(loaded, Scenario) else (loaded,))
    if dry_run:
        show_forecast(options, loaded)
        return
    place = options.place()
    folder = place["folder"]
    repeat = options.repeat("identify", folder)
    staged = not isinstance(loaded, Scenario)
    with ProgressDisplay(console(stderr=True), quiet=options.quiet) as display:
        done = (
            _one(loaded, place, repeat, display)
            if isinstance(loaded, Scenario)
            else _stages(loaded, place, repeat, display)
        )
    files, note = [*done.files, *options.page(folder)], ""
    if done.status == "interrupted":
        raise Interrupted(repeat)
    if export_fmu or (export_fmu is None and staged):
        target = loaded.fmu if isinstance(loaded, Scenario) else loaded.stages[-1].scenario.fmu
        try:
            files = [*files, write_identified_fmu(folder, target, done.parameters)]
        except ThsaCosimError as error:
            if export_fmu:
                raise
            note = f"note: no FMU with the identified values was written: {error}"

    def show(out: "Console") -> None:
        done.show(out)
        if note:
            out.print(note, highlight=False, markup=False, soft_wrap=True)

    options.conclude(folder / RESULT, len(files), show)


@dataclass(frozen=True)
class _Finished:
    """What a study left behind, and how to print it."""

    files: list[Path]
    status: str
    parameters: "ParameterSet"
    show: Callable[["Console"], None]


def _one(
    scenario: "Scenario", place: Place, repeat: str, on_progress: Callable[["Progress"], None]
) -> _Finished:
    from thsa_cosim.identify import identify as run
    from thsa_cosim.report.identify.files import write_identify
    from thsa_cosim.report.identify.tables import print_identify

    result = run(scenario, **place, on_progress=on_progress, command=repeat)
    files = write_identify(result, place["folder"])
    return _Finished(files, result.status, result.parameter_set, lambda out: print_identify(out, result))


def _stages(
    staged: "StagedScenario", place: Place, repeat: str, on_progress: Callable[["Progress"], None]
) -> _Finished:
    from thsa_cosim.report.staged import print_staged, write_staged
    from thsa_cosim.staged import run_stages

    result = run_stages(staged, **place, on_progress=on_progress, command=repeat)
    files = write_staged(result, place["folder"])
    return _Finished(files, result.status, result.parameter_set, lambda out: print_staged(out, result))
