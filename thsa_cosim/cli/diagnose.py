"""The command ``diagnose``."""

from dataclasses import replace
from pathlib import Path

import click

from thsa_cosim.cli.options import PATH, StudyOptions, study_options

#: Exit code of a study that has no usable result.
NOT_TESTED = 3


@click.command()
@study_options
@click.option("--package", type=PATH, default=None, help="Folder of the model's Modelica package.")
@click.option(
    "--with",
    "further",
    type=PATH,
    multiple=True,
    help="A recording to fit in addition to the others, as that of a study's experiment.csv; may be repeated.",
)
def diagnose(options: StudyOptions, package: Path | None, further: tuple[Path, ...]) -> None:
    """Find the effect that the model of SCENARIO lacks, add it, and report held-out errors before and after."""
    if further:
        options = replace(options, fit=(*(options.fit or _own(options.scenario)), *further))
    done = options.conduct(options.ask("diagnose", package))
    options.conclude(done)
    if done.open().result["verdict"] == "not-tested":
        raise click.exceptions.Exit(NOT_TESTED)


def _own(scenario: Path) -> tuple[Path, ...]:
    """The scenario's own fit recordings."""
    from thsa_cosim.scenario import load_scenario  # imports take their time

    return tuple(dict.fromkeys(recording.path for recording in load_scenario(scenario).fit))
