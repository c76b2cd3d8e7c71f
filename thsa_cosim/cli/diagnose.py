"""The command ``diagnose``."""

from pathlib import Path

import click

from thsa_cosim.cli.options import PATH, StudyOptions, study_options


@click.command()
@study_options
@click.option("--package", type=PATH, default=None, help="Folder of the model's Modelica package.")
def diagnose(options: StudyOptions, package: Path | None) -> None:
    """Find what the model of SCENARIO lacks: trace the residual to an effect, add it, report held-out errors."""
    options.conclude(options.conduct(options.ask("diagnose", package)))
