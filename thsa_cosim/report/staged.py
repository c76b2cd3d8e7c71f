"""Files and tables of an identification in stages."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console

from thsa_cosim import __version__
from thsa_cosim.inspection import Inspection
from thsa_cosim.report.files import RESULT, write_json
from thsa_cosim.report.identify.files import write_identify
from thsa_cosim.report.identify.result import identify_to_dict
from thsa_cosim.report.identify.tables import print_identify
from thsa_cosim.report.parameter_files import write_parameter_set
from thsa_cosim.report.simulate.files import write_simulate
from thsa_cosim.report.simulate.tables import print_simulate
from thsa_cosim.staged import StagedResult


def staged_to_dict(result: StagedResult) -> dict[str, Any]:
    """Return the stages as one result: points and laws of all of them, merged over temperature.

    ``error.fit`` holds the channels of the identified stages, with the stage's name before one that several
    have; ``error.validate`` those of the simulated ones, which no fit touched. ``stages`` holds each in full.
    """
    parts = {name: identify_to_dict(found) for name, found in result.identified.items()}
    checks = {name: found.to_dict() for name, found in result.simulated.items()}
    last = result.scenario.stages[-1].scenario
    failures: dict[str, int] = {}
    for part in (*parts.values(), *checks.values()):
        for reason, count in part["failures"].items():
            failures[reason] = failures.get(reason, 0) + count
    return {
        "kind": "identify",
        "title": result.scenario.title,
        "status": result.status,
        "seed": last.seed,
        "evaluations": sum(part["evaluations"] for part in (*parts.values(), *checks.values())),
        "failures": dict(sorted(failures.items())),
        "fmu": {"path": str(last.fmu.path), "sha256": last.fmu.sha256},
        "scenario": str(result.scenario.path),
        "version": __version__,
        "points": _merged_points(parts),
        "laws": {name: law for part in parts.values() for name, law in part["laws"].items()},
        "error": {
            "fit": _merged_errors({name: part["error"]["fit"] for name, part in parts.items()}),
            "validate": _merged_errors({name: _over_recordings(check) for name, check in checks.items()}),
        },
        "stages": {**parts, **checks},
        "data": _merged_data(result),
        "trust": _merged_trust(parts),
        "notes": list(result.notes),
    }


def write_staged(result: StagedResult, folder: Path) -> list[Path]:
    """Write every stage's files into its folder and the merged result.json into ``folder``."""
    written: list[Path] = []
    for number, stage in enumerate(result.scenario.stages, start=1):
        if stage.name in result.identified:
            written += write_identify(result.identified[stage.name], folder / f"{number}_{stage.name}")
        elif stage.name in result.simulated:
            written += write_simulate(result.simulated[stage.name], folder / f"{number}_{stage.name}")
    if result.parameter_set.values:
        written += write_parameter_set(folder, result.parameter_set)
    write_json(folder / RESULT, staged_to_dict(result))
    return [*written, folder / RESULT]


def print_staged(console: Console, result: StagedResult) -> None:
    """Print the tables of every stage under its name."""
    for stage in result.scenario.stages:
        console.rule(stage.scenario.title or stage.name, align="left")
        if stage.name in result.identified:
            print_identify(console, result.identified[stage.name])
        elif stage.name in result.simulated:
            print_simulate(console, result.simulated[stage.name])


def _merged_data(result: StagedResult) -> dict[str, Any]:
    """The findings of all stages."""
    found = [stage.scenario.data for stage in result.scenario.stages]
    findings = tuple(f for data in found for f in data.findings)
    return Inspection.of(findings, tuple(s for data in found for s in data.repairs)).to_dict()


def _merged_trust(parts: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Explained if every identified stage is."""
    reasons = [f"{name}: {reason}" for name, part in parts.items() for reason in part["trust"]["reasons"]]
    return {"verdict": "not-explained" if reasons else "explained", "reasons": reasons}


def _merged_points(parts: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    merged: dict[float | None, dict[str, Any]] = {}
    for part in parts.values():
        for point in part["points"]:
            temperature = point["temperature_degC"]
            entry = merged.setdefault(temperature, {"temperature_degC": temperature, "parameters": {}})
            entry["parameters"].update(point["parameters"])
    return [merged[t] for t in sorted(merged, key=lambda t: (t is None, t))]


def _over_recordings(check: Mapping[str, Any]) -> dict[str, Any]:
    """The largest error per channel over a stage's recordings: a bound that holds for each of them."""
    worst: dict[str, Any] = {}
    for recording in check["recordings"]:
        for channel, error in recording["error"].items():
            if channel not in worst or error["rmse"] > worst[channel]["rmse"]:
                worst[channel] = {**error, "recording": recording["name"]}
    return worst


def _merged_errors(stages: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    channels = [channel for errors in stages.values() for channel in errors]
    return {
        channel if channels.count(channel) == 1 else f"{stage}:{channel}": error
        for stage, errors in stages.items()
        for channel, error in errors.items()
    }
