"""What a tuning draws besides its gains: front, line and surface, checked against the parameters."""

from thsa_cosim.errors import ScenarioError, did_you_mean
from thsa_cosim.parameters import ParameterSpace
from thsa_cosim.scenario.metrics_schema import LOOP_METRICS, TERMS
from thsa_cosim.scenario.tune_schema import LineTable, ParetoTable, SurfaceTable, TuneTable


def checked_pareto(table: TuneTable) -> ParetoTable | None:
    """Return ``[pareto]``; ScenarioError for a term that there is not."""
    if table.pareto is None:
        return None
    known = [*TERMS, *(f"peak.{r.signal}" for r in table.requirements if r.signal)]
    for side in (table.pareto.x, table.pareto.y):
        if side not in known or side == "peak":
            raise ScenarioError(f"pareto: {side!r} is no term.{did_you_mean(side, known)}")
        if side == "effort" and table.metrics.effort is None:
            raise ScenarioError("pareto: effort needs metrics.effort, the signal that counts.")
        if side in LOOP_METRICS and table.loop is None:
            raise ScenarioError(f"pareto: {side} needs the table [loop].")
    return table.pareto


def checked_line(table: TuneTable, space: ParameterSpace) -> LineTable | None:
    """Return ``[line]``; ScenarioError for an unknown parameter."""
    if table.line is None:
        return None
    for name in (table.line.numerator, table.line.denominator):
        if name not in space.names:
            raise ScenarioError(f"line: {name!r} is no parameter.{did_you_mean(name, space.names)}")
    return table.line


def checked_surface(table: TuneTable, space: ParameterSpace) -> SurfaceTable | None:
    """Return ``[surface]``; ScenarioError for parameters that span no plane."""
    if table.surface is None:
        return None
    for name in table.surface.parameters:
        if name not in space.names:
            raise ScenarioError(
                f"surface.parameters: {name!r} is no parameter.{did_you_mean(name, space.names)}"
            )
    a, b = table.surface.parameters
    if a == b:
        raise ScenarioError("surface.parameters needs two different parameters.")
    return table.surface
