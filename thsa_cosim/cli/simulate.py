"""The command ``simulate``."""

import click

from thsa_cosim.cli.options import StudyOptions, study_options


@click.command()
@study_options
def simulate(options: StudyOptions) -> None:
    """Simulate each recording of SCENARIO once and compare; parameters to identify keep their start values."""
    options.conclude(options.conduct(options.ask("simulate")))
