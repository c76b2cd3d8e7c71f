"""The command ``identify``: one scenario, or several in stages."""

from dataclasses import replace
from typing import TYPE_CHECKING

import click

from thsa_cosim.cli.dry_run import dry_run_option, show_forecast
from thsa_cosim.cli.options import StudyOptions, study_options
from thsa_cosim.errors import ThsaCosimError

if TYPE_CHECKING:
    from thsa_cosim.api.conduct import Conducted
    from thsa_cosim.ssv import ParameterSet


@click.command(short_help="Identify parameters from recordings, at each temperature.")
@study_options
@click.option(
    "--export-fmu/--no-export-fmu",
    default=None,
    help="Also write the FMU with the identified values; default: only for a scenario with stages.",
)
@dry_run_option
def identify(options: StudyOptions, export_fmu: bool | None, dry_run: bool) -> None:
    """Identify the parameters of SCENARIO from its recordings, at each temperature."""
    from thsa_cosim.report.parameter_files import write_identified_fmu
    from thsa_cosim.scenario import StagedScenario

    asked = options.ask("identify")
    if dry_run:
        show_forecast(options, asked)
        return
    done, note = options.conduct(asked), ""
    scenario = asked.scenario
    staged = isinstance(scenario, StagedScenario)
    if export_fmu or (export_fmu is None and staged):
        target = scenario.stages[-1].scenario.fmu if isinstance(scenario, StagedScenario) else scenario.fmu
        try:
            written = write_identified_fmu(done.folder, target, _identified(done))
            done = replace(done, files=(*done.files, written))
        except ThsaCosimError as error:
            if export_fmu:
                raise
            note = f"note: no FMU with the identified values was written: {error}"
    options.conclude(done, note)


def _identified(done: "Conducted") -> "ParameterSet":
    """The identified start values: of the result, or of the file that a finished study has kept them in."""
    from thsa_cosim.ssv import ParameterSet, read_ssv

    if done.result is not None:
        found: ParameterSet = done.result.parameter_set
        return found
    file = done.folder / "identified.ssv"
    return read_ssv(file) if file.exists() else ParameterSet("", {}, {}, "")
