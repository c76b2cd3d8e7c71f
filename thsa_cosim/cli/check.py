"""The command ``check``: what an FMU, a recording or a scenario is, and what it can be trusted with."""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from thsa_cosim.cli.options import PATH, console
from thsa_cosim.errors import FmuError, ScenarioError

if TYPE_CHECKING:
    from rich.console import Console

    from thsa_cosim.check import CheckReport, Finding
    from thsa_cosim.identify.sensitivity import PointSensitivity
    from thsa_cosim.parameters import ParameterSpace
    from thsa_cosim.scenario import Scenario, StagedScenario, TuneScenario

Checked = tuple[Mapping[str, Any], Callable[["Console"], None]]
"""The report as JSON types, and how to print it."""

POSITIVE = click.FloatRange(min=0.0, min_open=True)
_WORSE = ["ok", "warning", "failed"].index
FAILED = 3
"""Exit code of a check whose verdict is "failed"."""


@click.command(short_help="Say what an FMU, a recording or a scenario can be trusted with.")
@click.argument("path", type=PATH)
@click.option("--json", "as_json", is_flag=True, help="Print the findings as JSON.")
@click.option("-o", "--output", type=PATH, default=None, help="Also write the findings as JSON to this file.")
@click.option("--duration", type=POSITIVE, help="FMU: time to simulate, s; default: its own.")
@click.option("--step", type=POSITIVE, help="FMU: communication step, s; default: its own.")
@click.option(
    "--deadline", type=POSITIVE, default=30.0, show_default=True, help="FMU: longest time of a run, s."
)
@click.option(
    "--time-limit",
    type=POSITIVE,
    default=300.0,
    show_default=True,
    help="FMU: wall time after which no further trial begins, s; what was not tried is named.",
)
@click.option(
    "--start", "starts", multiple=True, metavar="NAME=VALUE", help="FMU: a start value, a number or a text."
)
@click.option("--input", "ends", multiple=True, metavar="NAME=VALUE", help="FMU: final value of an input.")
@click.option(
    "--sensitivity",
    is_flag=True,
    help="Scenario: which parameter moves which signal, and the standard errors to expect, before any search.",
)
@click.option(
    "--compile", "compiled", type=PATH, help="FMU: build its C sources first, and write the FMU to this file."
)
def check(
    path: Path,
    as_json: bool,
    output: Path | None,
    duration: float | None,
    step: float | None,
    deadline: float,
    time_limit: float,
    starts: tuple[str, ...],
    ends: tuple[str, ...],
    sensitivity: bool,
    compiled: Path | None,
) -> int:
    """Describe an FMU, a recording or a scenario, and say what it can be trusted with.

    The ending of PATH decides: .toml is a scenario; .csv, .parquet, .mat and the like are recordings; all else is an
    FMU. An FMU runs in separate processes, with moving inputs, up to its stop time; the FMU of a scenario runs with
    the scenario's recordings, step and start values. The exit code is 3 if the verdict is "failed".
    """
    if compiled is not None:
        from thsa_cosim.fmu.sources import compile_sources

        path = compile_sources(path, compiled)
    _refuse_what_is_nothing(path)
    values, texts = _start_values(path, starts)
    given = {"duration": duration, "step": step, "values": values, "texts": texts, "ends": _pairs(ends)}
    points = _sensitivities(path) if sensitivity else ()
    limits = {"deadline_s": deadline, "limit_s": time_limit}
    content, show = _checked(path, given, limits)
    if points:
        content, show = _with_sensitivities(points, content, show)
    text = json.dumps(content, indent=2)
    if output is not None:
        output.write_text(text + "\n", encoding="utf-8")
    if as_json:
        click.echo(text)
    else:
        show(console())
    return FAILED if content["verdict"] == "failed" else 0


def _refuse_what_is_nothing(path: Path) -> None:
    """FmuError for a file of another ending that is no FMU either, such as a spreadsheet."""
    from thsa_cosim.fmu.archive import open_archive
    from thsa_cosim.recordings import SUFFIXES

    if path.suffix.lower() in (".toml", ".fmu", ".ssp", *SUFFIXES) or not path.is_file():
        return
    with suppress(FmuError), open_archive(path) as archive:
        if {"modelDescription.xml", "SystemStructure.ssd"} & set(archive.namelist()):
            return
    raise FmuError(
        f"{path}: check reads FMUs (.fmu, .ssp), scenarios (.toml) and recordings ({', '.join(SUFFIXES)}), and this is"
        " none of them; save a table as .csv."
    )


def _start_values(path: Path, starts: tuple[str, ...]) -> tuple[dict[str, float], dict[str, str]]:
    """Start values of numbers, and those of the FMU's String variables."""
    from thsa_cosim.recordings import SUFFIXES
    from thsa_cosim.system import read_description

    if not starts or path.suffix.lower() in (".toml", *SUFFIXES):
        return _pairs(starts), {}
    strings = {v.name for v in read_description(path).variables.values() if v.type == "String"}
    split = [start.partition("=") for start in starts]
    texts = {name.strip(): text for name, _, text in split if name.strip() in strings}
    return _pairs(tuple(s for s in starts if s.partition("=")[0].strip() not in strings)), texts


def _pairs(texts: tuple[str, ...]) -> dict[str, float]:
    pairs = {}
    for text in texts:
        name, separator, value = text.rpartition("=")
        try:
            pairs[name.strip()] = float(value)
        except ValueError:
            separator = ""
        if not separator:
            raise click.UsageError(f"{text!r} is no NAME=VALUE with a number.")
    return pairs


def _checked(path: Path, given: Mapping[str, Any], limits: Mapping[str, float]) -> Checked:
    from thsa_cosim.recordings import SUFFIXES

    if path.suffix.lower() == ".toml":
        return _scenario(path, limits)
    return _recording(path) if path.suffix.lower() in SUFFIXES else _fmu(path, given, limits)


def _fmu(path: Path, given: Mapping[str, Any], limits: Mapping[str, float]) -> Checked:
    from thsa_cosim.check import Excitation, check_fmu
    from thsa_cosim.report.check import print_check

    with _trying(path) as on_finding:
        report = check_fmu(
            path,
            excitation=Excitation(**given),
            deadline_s=limits["deadline_s"],
            limit_s=limits["limit_s"],
            on_finding=on_finding,
        )
    return {"kind": "fmu", **report.to_dict()}, lambda out: print_check(out, report)


@contextmanager
def _trying(path: Path) -> "Iterator[Callable[[Finding], None] | None]":
    """On a terminal, say what was tried last, and the time since the begin: a slow FMU takes minutes."""
    out = console(stderr=True)
    if not out.is_terminal:
        yield None
        return
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    with Progress(*columns, console=out, transient=True) as bar:
        task = bar.add_task(f"trying {path.name}", total=None)
        yield lambda finding: bar.update(
            task, description=f"trying {path.name}: {finding.name} {finding.verdict}"
        )


def _recording(path: Path) -> Checked:
    from thsa_cosim.inspection import inspect_file
    from thsa_cosim.report.inspection import print_file

    report = inspect_file(path)
    return report.to_dict(), lambda out: print_file(out, report)


def _scenario(path: Path, limits: Mapping[str, float]) -> Checked:
    """A scenario loads, or says in one sentence why not; then its data and its FMU."""
    from thsa_cosim.inspection import Inspection
    from thsa_cosim.report.check import print_check
    from thsa_cosim.report.inspection import print_inspection
    from thsa_cosim.scenario import StagedScenario, load

    loaded = load(path)
    scenarios = (
        [stage.scenario for stage in loaded.stages] if isinstance(loaded, StagedScenario) else [loaded]
    )
    of_recordings = [s.data for s in scenarios]
    findings = tuple(f for data in of_recordings for f in data.findings)
    data = Inspection.of(findings, tuple(s for data in of_recordings for s in data.repairs))
    with _trying(path) as on_finding:
        report = _fmu_of(loaded, limits, on_finding)
    verdict = max(
        {"good": "ok", "usable": "warning", "bad": "failed"}[data.verdict], str(report.verdict), key=_WORSE
    )
    content = {
        "kind": "scenario",
        "path": str(path),
        "scenario": {"kind": loaded.kind, "title": loaded.title},
        "data": data.to_dict(),
        "fmu": report.to_dict(),
        "verdict": verdict,
    }

    def show(out: "Console") -> None:
        out.print(f"{path}: a scenario of kind {loaded.kind!r} that loads", highlight=False, markup=False)
        print_inspection(out, data, remedies=True)
        print_check(out, report)
        out.print(f"verdict: {verdict}", highlight=False)

    return content, show


def _sensitivities(path: Path) -> "tuple[PointSensitivity, ...]":
    """What the recordings of an identification say about its parameters, at their start values."""
    from thsa_cosim.identify.sensitivity import sensitivity
    from thsa_cosim.scenario import Executor, Scenario, StagedScenario, load

    loaded = load(path) if path.suffix.lower() == ".toml" else None
    stages = [s.scenario for s in loaded.stages] if isinstance(loaded, StagedScenario) else [loaded]
    scenarios = [
        s for s in stages if isinstance(s, Scenario) and s.points and s.points[0].fit and len(s.parameters)
    ]
    if not scenarios:
        raise ScenarioError(
            f"{path}: --sensitivity needs a scenario with recordings to fit and [[parameters]]; add them."
        )
    return tuple(point for scenario in scenarios for point in sensitivity(scenario, Executor()))


def _with_sensitivities(
    points: "tuple[PointSensitivity, ...]", content: Mapping[str, Any], show: Callable[["Console"], None]
) -> Checked:
    from thsa_cosim.report.identify.sensitivity import print_sensitivity, sensitivity_dict

    def shown(out: "Console") -> None:
        show(out)
        print_sensitivity(out, points)

    return {**content, "sensitivity": sensitivity_dict(points)}, shown


def _alternatives(
    space: "ParameterSpace", recording: str, variables: tuple[str, ...]
) -> dict[str, tuple[float, ...]]:
    """Values that a search may give each variable, one parameter moved at a time: within, then at either bound."""
    start = space.start()
    ways: dict[str, list[float]] = {name: [] for name in variables}
    usual = space.assignments(space.decode(start), recording)
    for i, at in enumerate(start):
        for place in (at + 0.3 if at <= 0.5 else at - 0.3, 0.0, 1.0):
            vector = start.copy()
            vector[i] = place
            moved = space.assignments(space.decode(vector), recording)
            for name in variables:
                if moved[name] != usual[name]:
                    ways[name].append(moved[name])
    return {name: tuple(values) for name, values in ways.items() if values}


def _fmu_of(
    loaded: "Scenario | StagedScenario | TuneScenario",
    limits: Mapping[str, float],
    on_finding: "Callable[[Finding], None] | None",
) -> "CheckReport":
    """Try the FMU of a scenario with its own excitation: the first recording to fit, or the first condition."""
    from thsa_cosim.check import Excitation, check_fmu
    from thsa_cosim.identify.problem import build_point
    from thsa_cosim.scenario import StagedScenario, TuneScenario
    from thsa_cosim.tune.problem import build_groups

    if isinstance(loaded, StagedScenario):
        loaded = loaded.stages[0].scenario
    spec = loaded.simulation
    values: dict[str, float] = {}
    searched: tuple[str, ...] = ()
    alternatives: dict[str, tuple[float, ...]] = {}
    if isinstance(loaded, TuneScenario):
        experiment = build_groups(loaded)[0].cases[0].experiment
        searched = tuple(p.variable for p in loaded.parameters.parameters)
    else:
        if not loaded.points or not loaded.points[0].fit:
            raise ScenarioError(f"{loaded.path} names no recording to try its FMU with; name one under fit.")
        point = build_point(loaded, loaded.points[0])
        case = point.cases[0]
        experiment = case.experiment(case.name, None)
        start = point.space.physical(point.space.start()[None, :])[0]
        named = dict(zip(point.space.names, start.tolist(), strict=True))
        values = point.space.assignments(named, case.name)
        searched = tuple(n for n in values if n not in experiment.wrapper_names)
        alternatives = _alternatives(point.space, case.name, searched)
    own = experiment.wrapper_names
    values = {n: v for n, v in {**experiment.fixed, **values}.items() if n not in own}
    return check_fmu(
        experiment.fmu,
        excitation=Excitation(
            values,
            texts=experiment.texts,
            inputs=experiment.inputs,
            time=experiment.time,
            parameters=searched,
            alternatives=alternatives,
            tolerance=spec.tolerance,
            kind=spec.interface,
            input_mode=spec.inputs,
        ),
        deadline_s=min(spec.deadline, limits["deadline_s"]),
        limit_s=limits["limit_s"],
        cycles=20,
        on_finding=on_finding,
    )
