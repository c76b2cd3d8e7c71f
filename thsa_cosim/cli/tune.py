"""The command ``tune``."""

import click

from thsa_cosim.cli.dry_run import dry_run_option, show_forecast
from thsa_cosim.cli.options import StudyOptions, study_options


@click.command(short_help="Tune gains for a command and its conditions.")
@study_options
@dry_run_option
def tune(options: StudyOptions, dry_run: bool) -> None:
    """Tune the gains of SCENARIO for its command and conditions; schedule them if it asks for that."""
    asked = options.ask("tune")
    if dry_run:
        show_forecast(options, asked)
    else:
        options.conclude(options.conduct(asked))
