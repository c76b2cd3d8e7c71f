"""From its table to a :class:`Scenario`, which has recordings: files read, units converted, everything checked."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from thsa_cosim.errors import ScenarioError, did_you_mean
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.parameters import ParameterSpace
from thsa_cosim.recordings import Column, Recording, TimeAxis, read_recording
from thsa_cosim.scenario import check
from thsa_cosim.scenario.files import expand, named
from thsa_cosim.scenario.law_search import with_laws
from thsa_cosim.scenario.model import Scenario, TemperaturePoint
from thsa_cosim.scenario.parameter_set import with_parameter_set
from thsa_cosim.scenario.recording_schema import TemperatureTable
from thsa_cosim.scenario.schema import (
    ChannelTable,
    CommonTable,
    CostTable,
    DiagnoseTable,
    IdentifyTable,
    LawTable,
    SearchTable,
    SimulateTable,
)
from thsa_cosim.scenario.system import open_model


def resolve_recorded(
    path: Path,
    table: CommonTable,
    fit: Sequence[Path | str],
    validate: Sequence[Path | str],
    seed: int | None,
    fmu: FmuDescription | Path | str | None,
) -> Scenario:
    """Return the scenario of ``table``; arguments and errors as of ``load``."""
    description = open_model(path, table, fmu)
    given, table = with_parameter_set(path, table, description)
    inputs, measured = check.roles(table, description)
    started = check.started(table, description)
    parameters = check.parameters(table, description) if isinstance(table, IdentifyTable) else ()
    space = ParameterSpace(tuple(p for p, _ in parameters))
    fixed = check.fixed(path, table, description, space, given)
    outputs = check.outputs(table, description, measured)
    cost = _cost(table, measured, inputs)
    files = {
        "fit": expand(path, "recordings.fit", table.recordings.fit, fit),
        "validate": expand(path, "recordings.validate", table.recordings.validate_, validate),
    }
    if both := set(files["fit"]) & set(files["validate"]):
        raise ScenarioError(
            f"{min(both)} is both a fit and a validate recording; remove it from one of them."
        )
    if not files["fit"] and not (isinstance(table, SimulateTable) and files["validate"]):
        raise ScenarioError("recordings.fit names no recording; add one, or give it with --fit.")
    read = _recordings(table, files, description, started, parts_held_out=not validate)
    space = with_laws(table, space, read["fit"])
    per_recording = [p.name for p, where in parameters if where == "recording"]
    scenario = Scenario(
        kind=table.kind,
        path=path,
        table=table,
        title=table.title,
        seed=table.seed if seed is None else seed,
        fmu=description,
        fit=read["fit"],
        validate=read["validate"],
        points=_points(table.temperature, read["fit"], read["validate"], fixed, space, per_recording),
        inputs=inputs,
        measured=measured,
        outputs=outputs,
        fixed=fixed,
        parameters=space,
        laws=_laws(table),
        cost=cost,
        search=_search(table, space),
        simulation=table.simulation,
        round_to=table.temperature.round_to if table.temperature else 1.0,
        zeroed=check.zeroed(table, description),
        force=check.force(table, description, measured) if isinstance(table, IdentifyTable) else None,
        diagnose=(
            check.diagnosis(path, table, description, inputs, measured)
            if isinstance(table, DiagnoseTable)
            else None
        ),
    )
    if isinstance(table, IdentifyTable):
        for recording in scenario.fit:
            for channel in cost.channels:
                scenario.noise(recording, channel)
    return scenario


def _recordings(
    table: CommonTable,
    files: Mapping[str, Sequence[Path]],
    description: FmuDescription,
    started: Sequence[str],
    *,
    parts_held_out: bool,
) -> dict[str, tuple[Recording, ...]]:
    """Read the files of each role; parts cut the fit files, ``parts_held_out``: into both roles."""
    columns = {name: column.source() for name, column in table.recordings.columns.items()}
    driven = frozenset(name for name in columns if description.variables[name].causality == "input")
    units = {name: description.variables[name].unit or None for name in columns}
    source = table.temperature
    temperature: str | Column | None = None
    if source is not None:
        temperature = source.input or Column(column=source.column, unit=source.unit)
    whole = TimeAxis(**table.recordings.time.model_dump())
    found: dict[str, list[Recording]] = {"fit": [], "validate": []}

    def read(role: str, path: Path, axis: TimeAxis, name: str) -> None:
        recording = read_recording(
            path, columns, time=axis, units=units, temperature=temperature, name=name, driven=driven
        ).with_start(started)
        for variable, value in recording.start.items():
            where = f"{path}: recordings.columns.{variable}"
            check.check_range(description.variables[variable], value, where, description)
        found[role].append(recording)

    for role, paths in files.items():
        for path, name in named(paths):
            if role == "fit" and table.recordings.parts:
                for part in table.recordings.parts:
                    if part.use == "fit" or parts_held_out:
                        axis = replace(whole, start=part.start, stop=part.stop)
                        read(part.use, path, axis, f"{name} {part.name}")
            else:
                read(role, path, whole, name)
    return {role: tuple(recordings) for role, recordings in found.items()}


def _points(
    temperature: TemperatureTable | None,
    fit: Sequence[Recording],
    validate: Sequence[Recording],
    fixed: Mapping[str, float],
    space: ParameterSpace,
    per_recording: Sequence[str],
) -> tuple[TemperaturePoint, ...]:
    """Group recordings by rounded temperature, coldest first, or all of them together."""

    def rounded(recording: Recording) -> float | None:
        if temperature is None or temperature.group != "point" or recording.temperature_degC is None:
            return None
        return round(recording.temperature_degC / temperature.round_to) * temperature.round_to + 0.0

    groups = dict.fromkeys(rounded(r) for r in (fit or validate))
    points = []
    for value in sorted(groups, key=lambda t: -1e9 if t is None else t):
        members = tuple(r for r in fit if rounded(r) == value)
        held_out = tuple(r for r in validate if rounded(r) == value)
        searched = space.for_recordings([r.name for r in members], per_recording)
        points.append(TemperaturePoint(value, members, held_out, fixed, searched))
    return tuple(points)


def _laws(table: CommonTable) -> dict[str, LawTable]:
    if not isinstance(table, IdentifyTable):
        return {}
    return {p.name: p.law for p in table.parameters if p.law is not None}


def _cost(table: CommonTable, measured: Sequence[str], inputs: Sequence[str]) -> CostTable:
    cost = table.cost
    for name in cost.channels:
        if name in inputs:
            raise ScenarioError(f"cost.channels.{name} is an input of the FMU; compare outputs only.")
        if name not in measured:
            raise ScenarioError(
                f"cost.channels.{name} has no recorded column; add [recordings.columns.{name}] or remove it."
                f"{did_you_mean(name, measured)}"
            )
    channels = cost.channels or {name: ChannelTable() for name in measured}
    if isinstance(table, IdentifyTable) and not channels:
        raise ScenarioError("recordings.columns names inputs only; add a measured output to compare with.")
    return CostTable.resolved(cost, channels=channels)


def _search(table: CommonTable, space: ParameterSpace) -> SearchTable:
    if not isinstance(table, IdentifyTable):
        return SearchTable()
    for name in table.search.profile:
        if name not in space.names:
            raise ScenarioError(
                f"search.profile names {name!r}, which is no parameter of [[parameters]]."
                f"{did_you_mean(name, space.names)}"
            )
    return table.search
