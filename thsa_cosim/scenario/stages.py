"""Scenarios in stages: benches in order, each with what the earlier ones found."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from thsa_cosim.errors import InputError, ScenarioError, UnitError, did_you_mean
from thsa_cosim.scenario.model import Scenario
from thsa_cosim.scenario.recorded import load_scenario
from thsa_cosim.scenario.schema import KINDS, StagesTable
from thsa_cosim.scenario.sentences import from_validation, one_line
from thsa_cosim.scenario.source import read_toml
from thsa_cosim.units import convert

Found = Callable[[float | None], Mapping[str, float]]
"""Values by parameter name, in the scenario's units, for a temperature [degC] (None: there is only one)."""


@dataclass(frozen=True, eq=False)
class Stage:
    """One scenario of several; ``give`` names the results that later stages get."""

    name: str
    scenario: Scenario
    give: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class StagedScenario:
    """Scenarios that run in order."""

    kind: str
    path: Path
    title: str
    stages: tuple[Stage, ...]


def load_stages(path: Path, data: Mapping[str, Any], seed: int | None = None) -> StagedScenario:
    """Read the scenarios that ``[[stages]]`` names; all of them are checked at once.

    Raises
    ------
    ThsaCosimError
        As :func:`load_scenario`, and ScenarioError for stages that cannot work.
    """
    try:
        table = StagesTable.model_validate(data)
    except ValidationError as error:
        raise from_validation(path, data, error) from None
    if table.kind not in KINDS:
        raise ScenarioError(one_line(f"{path}: kind is {table.kind!r}.{did_you_mean(table.kind, KINDS)}"))
    stages = [_stage(path, k, table, seed) for k in range(len(table.stages))]
    names = [stage.name for stage in stages]
    if repeated := {name for name in names if names.count(name) > 1}:
        raise ScenarioError(one_line(f"{path}: stage {min(repeated)!r} appears twice; remove one."))
    return StagedScenario(table.kind, path, table.title, tuple(stages))


def _stage(path: Path, k: int, table: StagesTable, seed: int | None) -> Stage:
    spec = table.stages[k]
    file = path.parent / spec.scenario
    key = f"stages[{k + 1}]"
    try:
        if "stages" in read_toml(file):
            raise ScenarioError(f"{file} has stages itself; list those instead.")
        scenario = load_scenario(file, seed=table.seed if seed is None else seed)
    except InputError as error:
        raise type(error)(one_line(f"{path}: {key}: {error}")) from None
    if scenario.parameters.combinations:
        raise ScenarioError(
            one_line(f"{path}: {key}: {file.name} searches laws (temperature.group = 'law'), no stage.")
        )
    known = scenario.parameters.names
    for name in spec.give or ():
        if name not in known:
            raise ScenarioError(
                one_line(
                    f"{path}: {key}.give names {name!r}, which {file.name} does not find."
                    f"{did_you_mean(name, known)}"
                )
            )
    return Stage(file.stem, scenario, tuple(spec.give) if spec.give is not None else known)


def hand_on(stage: Stage, found: Found, target: Scenario) -> Scenario:
    """Return ``target`` with what ``stage`` found as start values, at each of the target's temperatures.

    Parameters of FMU variables that the target's FMU does not have, or that the target searches for itself, are
    left out. The other coefficients of a found law are 0 there as they were in the stage.

    Raises
    ------
    ScenarioError
        If a variable has another dimension in the target's FMU.
    """
    variables = target.fmu.variables
    given: dict[float | None, dict[str, float]] = {}
    for point in target.points:
        values = found(point.temperature_degC)
        start: dict[str, float] = {}
        for name in stage.give:
            parameter = stage.scenario.parameters[name]
            if parameter.variable not in variables:
                continue
            start.update({zero: 0.0 for zero in stage.scenario.zeroed.get(name, ()) if zero in variables})
            unit = variables[parameter.variable].unit or parameter.variable_unit or parameter.unit
            try:
                start[parameter.variable] = convert(values[name], parameter.unit, unit)
            except UnitError as error:
                raise ScenarioError(one_line(f"{target.path}: {parameter.variable!r}: {error}")) from None
        given[point.temperature_degC] = start
    return target.given(given)
