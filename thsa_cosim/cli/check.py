"""The command ``check``: what an FMU, a recording or a scenario is, and what it can be trusted with."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from thsa_cosim.cli.options import PATH, console

if TYPE_CHECKING:
    from rich.console import Console

Checked = tuple[Mapping[str, Any], Callable[["Console"], None]]
"""The report as JSON types, and how to print it."""

FAILED = 3
"""Exit code of a check whose verdict is "failed"."""


@click.command()
@click.argument("path", type=PATH)
@click.option("--json", "as_json", is_flag=True, help="Print the findings as JSON.")
@click.option("-o", "--output", type=PATH, default=None, help="Write the findings as JSON to this file, too.")
def check(path: Path, as_json: bool, output: Path | None) -> int:
    """Say what an FMU, a recording or a scenario is, and what it can be trusted with.

    PATH is told by its ending: .toml is a scenario, .csv, .parquet, .mat and the like a recording, all else an FMU.
    The exit code is 3 if the verdict is "failed".
    """
    content, show = _checked(path)
    text = json.dumps(content, indent=2)
    if output is not None:
        output.write_text(text + "\n", encoding="utf-8")
    if as_json:
        click.echo(text)
    else:
        show(console())
    return FAILED if content["verdict"] == "failed" else 0


def _checked(path: Path) -> Checked:
    from thsa_cosim.recordings import SUFFIXES

    if path.suffix.lower() == ".toml":
        return _scenario(path)
    return _recording(path) if path.suffix.lower() in SUFFIXES else _fmu(path)


def _fmu(path: Path) -> Checked:
    from thsa_cosim.check import check_fmu
    from thsa_cosim.report.check import print_check

    report = check_fmu(path)
    return {"kind": "fmu", **report.to_dict()}, lambda out: print_check(out, report)


def _recording(path: Path) -> Checked:
    from thsa_cosim.inspection import inspect_file
    from thsa_cosim.report.inspection import print_file

    report = inspect_file(path)
    return report.to_dict(), lambda out: print_file(out, report)


def _scenario(path: Path) -> Checked:
    """A scenario loads, or says in one sentence why not; then its data and its FMU."""
    from thsa_cosim.inspection import Inspection
    from thsa_cosim.report.inspection import print_inspection
    from thsa_cosim.scenario import Scenario, StagedScenario, load_tune
    from thsa_cosim.scenario.load import read_toml
    from thsa_cosim.scenario.stages import load_study

    loaded = load_tune(path) if read_toml(path).get("kind") == "tune" else load_study(path)
    scenarios = (
        [stage.scenario for stage in loaded.stages] if isinstance(loaded, StagedScenario) else [loaded]
    )
    of_recordings = [s.data for s in scenarios if isinstance(s, Scenario)]
    findings = tuple(f for data in of_recordings for f in data.findings)
    data = Inspection.of(findings, tuple(s for data in of_recordings for s in data.repairs))
    verdict = {"good": "ok", "usable": "warning", "bad": "failed"}[data.verdict]
    content = {
        "kind": "scenario",
        "path": str(path),
        "scenario": {"kind": loaded.kind, "title": loaded.title},
        "data": data.to_dict(),
        "verdict": verdict,
    }

    def show(out: "Console") -> None:
        out.print(f"{path}: a scenario of kind {loaded.kind!r} that loads", highlight=False, markup=False)
        print_inspection(out, data, remedies=True)
        out.print(f"verdict: {verdict}", highlight=False)

    return content, show
