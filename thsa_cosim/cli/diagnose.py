"""The command ``diagnose``."""

from pathlib import Path

import click

from thsa_cosim.cli.options import PATH, StudyOptions, study_options

#: Exit code of a study that has no usable result.
NOT_TESTED = 3


@click.command()
@study_options
@click.option("--package", type=PATH, default=None, help="Folder of the model's Modelica package.")
def diagnose(options: StudyOptions, package: Path | None) -> None:
    """Find the effect that the model of SCENARIO lacks, add it, and report held-out errors before and after."""
    done = options.conduct(options.ask("diagnose", package))
    options.conclude(done)
    if done.open().result["verdict"] == "not-tested":
        raise click.exceptions.Exit(NOT_TESTED)
