"""The command ``diagnose``."""

import json
import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from thsa_cosim.cli.options import PATH, StudyOptions, console, study_options

if TYPE_CHECKING:
    from thsa_cosim.scenario import Scenario


#: Exit code of a study that has no usable result.
NOT_TESTED = 3


@click.command()
@study_options
@click.option("--package", type=PATH, default=None, help="Folder of the model's Modelica package.")
def diagnose(options: StudyOptions, package: Path | None) -> None:
    """Find what the model of SCENARIO lacks: trace the residual to an effect, add it, report held-out errors."""
    from thsa_cosim.diagnosis import diagnose as run
    from thsa_cosim.report.diagnose.result import write_diagnosis
    from thsa_cosim.report.diagnose.tables import print_diagnosis
    from thsa_cosim.report.files import RESULT
    from thsa_cosim.report.progress import StepDisplay
    from thsa_cosim.scenario import load_scenario

    loaded = load_scenario(options.scenario, **options.overrides)
    options.check_kind(loaded.kind, "diagnose")
    loaded = _with_package(loaded, package)
    options.show_data(loaded)
    place = options.place()
    folder = place["folder"]
    if not _is_complete(loaded, folder):
        repeat = options.repeat("diagnose", folder)
        repeat += "" if package is None else f" --package {shlex.quote(str(package))}"
        with StepDisplay(console(stderr=True), quiet=options.quiet) as display:
            result = run(loaded, **place, on_progress=display, command=repeat)
        write_diagnosis(result, folder)
    options.page(folder)
    files = sum(path.is_file() for path in folder.rglob("*"))
    content = _read(folder / RESULT)
    options.conclude(folder / RESULT, files, lambda out: print_diagnosis(out, content))
    if content["verdict"] == "not-tested":
        raise click.exceptions.Exit(NOT_TESTED)


def _with_package(scenario: "Scenario", package: Path | None) -> "Scenario":
    """Replace the Modelica package that the scenario names, if another one is given."""
    if package is None or scenario.diagnose is None:
        return scenario
    return replace(scenario, diagnose=replace(scenario.diagnose, package=package))


def _is_complete(scenario: "Scenario", folder: Path) -> bool:
    """Whether the folder holds this very study with its result; InputError if it holds another one."""
    from thsa_cosim.report.files import RESULT
    from thsa_cosim.study import open_study, study_identity

    if not (folder / RESULT).is_file():
        return False
    open_study(folder, study_identity(scenario))
    try:
        return _read(folder / RESULT).get("status") == "complete"
    except (OSError, ValueError, AttributeError):
        return False  # a damaged result is written anew


def _read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content
