"""The command ``simulate``."""

import click

from thsa_cosim.cli.options import StudyOptions, study_options


@click.command(short_help="Simulate each recording once and compare.")
@study_options
def simulate(options: StudyOptions) -> None:
    """Simulate each recording of SCENARIO once and compare; parameters to identify keep their start values."""
    options.conclude(options.conduct(options.ask("simulate")))
