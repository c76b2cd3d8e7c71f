"""The command ``identify``: one scenario, or several in stages."""

from dataclasses import replace

import click

from thsa_cosim.cli.dry_run import dry_run_option, show_forecast
from thsa_cosim.cli.options import StudyOptions, study_options
from thsa_cosim.errors import ThsaCosimError


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
            written = write_identified_fmu(done.folder, target, done.result.parameter_set)
            done = replace(done, files=(*done.files, written))
        except ThsaCosimError as error:
            if export_fmu:
                raise
            note = f"note: no FMU with the identified values was written: {error}"
    options.conclude(done, note)
