"""The command ``diagnose``."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from thsa_cosim.cli.options import PATH, StudyOptions, console, study_options

#: Exit code of a study that has no usable result.
NOT_TESTED = 3


@click.command(short_help="Find the effect that the model lacks, add it, and judge it.")
@study_options
@click.option("--package", type=PATH, default=None, help="Folder of the model's Modelica package.")
@click.option(
    "--with",
    "further",
    type=PATH,
    multiple=True,
    help="A recording to fit in addition to the others, as that of a study's experiment.csv; may be repeated.",
)
@click.option(
    "--next",
    "ahead",
    is_flag=True,
    help="Print the next experiment and what it should show, in place of the tables.",
)
def diagnose(options: StudyOptions, package: Path | None, further: tuple[Path, ...], ahead: bool) -> None:
    """Find the effect that the model of SCENARIO lacks, add it, and report held-out errors before and after."""
    if further:
        options = replace(options, fit=(*(options.fit or _own(options.scenario)), *further))
    done = options.conduct(options.ask("diagnose", package))
    if ahead and not options.as_json:
        _print_next(done.folder, done.open().result)
    else:
        options.conclude(done)
    if done.open().result["verdict"] == "not-tested":
        raise click.exceptions.Exit(NOT_TESTED)


def _print_next(folder: Path, result: Mapping[str, Any]) -> None:
    """The next experiment of a study, and where its profile is."""
    from thsa_cosim.report.diagnose.tables import next_experiment
    from thsa_cosim.report.parts.text import number

    out = console()
    for sentence in next_experiment(result):
        out.print(sentence, highlight=False, markup=False, soft_wrap=True)
    best = result["experiment"]
    if best is None:
        return
    out.print(f"{number(best['seconds'], 3)} s in {folder / best['file']}; the model expects", soft_wrap=True)
    for name, (low, high) in best["reached"].items():
        out.print(f"  {name}: {number(low, 3)} to {number(high, 3)}", highlight=False, markup=False)


def _own(scenario: Path) -> tuple[Path, ...]:
    """The scenario's own fit recordings."""
    from thsa_cosim.scenario import Scenario, load  # imports take their time

    return tuple(dict.fromkeys(recording.path for recording in load(scenario, Scenario).fit))
