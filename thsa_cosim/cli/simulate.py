"""The command ``simulate``."""

import click

from thsa_cosim.cli.options import StudyOptions, study_options


@click.command()
@study_options
def simulate(options: StudyOptions) -> None:
    """Run SCENARIO once per recording and compare; parameters to be identified keep their start values."""
    options.conclude(options.conduct(options.ask("simulate")))
