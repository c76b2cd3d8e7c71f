"""Scenarios in stages: benches in order, each with what the earlier ones found."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from thsa_cosim.errors import ScenarioError, UnitError
from thsa_cosim.scenario.model import Scenario
from thsa_cosim.scenario.sentences import one_line
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
