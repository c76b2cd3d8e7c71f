"""How sure an identification was: its result.json as samples for a tuning."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.errors import ParameterError, ScenarioError, UnitError, did_you_mean
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.scenario import check
from thsa_cosim.scenario.tune_model import Axis, CovariancePoint, UncertaintySpec
from thsa_cosim.scenario.tune_schema import TuneTable
from thsa_cosim.units import conversion


def read_uncertainty(
    path: Path, table: TuneTable, axes: Sequence[Axis], fmu: FmuDescription
) -> UncertaintySpec | None:
    """Return what ``[uncertainty]`` asks for, None without it; ``path`` is the scenario's.

    Raises
    ------
    ScenarioError, ParameterError, UnitError
        If the result cannot be read, lacks a parameter or its error, or a variable is no parameter of the FMU.
    """
    spec = table.uncertainty
    if spec is None:
        return None
    file = path.parent / spec.result
    try:
        points = json.loads(file.read_text(encoding="utf-8"))["points"]
        read = [_point(point, spec.variables) for point in points]
        units = {n: str(points[0]["parameters"][n]["unit"]) for n in spec.variables}
    except OSError as error:
        raise ScenarioError(f"uncertainty.result: {file} cannot be read ({error.strerror}).") from None
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise ScenarioError(
            f"uncertainty.result: {file} is no result of an identification of these parameters"
            f" ({type(error).__name__}: {error})."
        ) from None
    if spec.temperature is not None and spec.temperature not in [axis.name for axis in axes]:
        raise ScenarioError(
            f"uncertainty.temperature: {spec.temperature!r} is none of the [conditions]."
            f"{did_you_mean(spec.temperature, [axis.name for axis in axes])}"
        )
    factors = []
    searched = {p.variable for p in table.parameters}
    for name, target in spec.variables.items():
        key = f"uncertainty.variables.{name}"
        variable = check.settable(fmu, target, key)
        if target in searched:
            raise ScenarioError(f"{key}: {target!r} is tuned; it cannot be uncertain as well.")
        try:
            factors.append(conversion(units[name], variable.unit or units[name])[0])
        except UnitError as error:
            raise UnitError(f"{key}: {error}") from None
    return UncertaintySpec.resolved(spec, factors=tuple(factors), points=tuple(read))


def _point(point: Mapping[str, Any], wanted: Mapping[str, str]) -> CovariancePoint:
    names = list(point["parameters"])
    rows = [names.index(name) for name in wanted]
    stderr = [point["parameters"][name]["stderr"] for name in wanted]
    correlation = np.array(
        [[np.nan if c is None else c for c in row] for row in point["correlation"]], dtype=np.float64
    )[np.ix_(rows, rows)]
    if any(s is None or not s >= 0.0 for s in stderr) or not np.isfinite(correlation).all():
        where = point.get("label", point["temperature_degC"])
        raise ParameterError(
            f"uncertainty.result: a parameter has no standard error at {where}; leave it out."
        )
    return CovariancePoint(point["temperature_degC"], np.array(stderr, dtype=np.float64), correlation)
