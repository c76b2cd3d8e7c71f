"""What the drawing says of identified values: a published law, the scenario's start value, or the FMU's own."""

from collections.abc import Mapping

import numpy as np

from thsa_cosim.fmu import FmuDescription
from thsa_cosim.identify.results import PointResult
from thsa_cosim.inspection.hidden import Expected
from thsa_cosim.laws import published_law
from thsa_cosim.parameters import Parameter, ParameterSpace
from thsa_cosim.scenario.schema import LawTable


def expected_values(
    point: PointResult,
    space: ParameterSpace,
    laws: Mapping[str, LawTable],
    fmu: FmuDescription,
    zeroed: Mapping[str, tuple[str, ...]],
) -> list[Expected]:
    """Return the values at ``point`` in the order of ``space``, beside what is expected of them.

    ``zeroed``: FMU parameters that are 0 because of a parameter, by its name: the FMU's value is no quantity then.
    """
    values = {name: estimate.value for name, estimate in point.parameters.items()}
    scales = space.slope(np.clip(space.unit([values[p.name] for p in space.parameters]), 0.0, 1.0))
    found = []
    for parameter, scale in zip(space.parameters, scales.tolist(), strict=True):
        estimate = point.parameters[parameter.name]
        law = laws.get(parameter.name)
        found.append(
            Expected(
                name=parameter.name,
                unit=parameter.unit,
                value=estimate.value,
                stderr=estimate.stderr if estimate.identifiable else None,
                expected=_expected(
                    parameter, point.temperature_degC, law, fmu, bool(zeroed.get(parameter.name))
                ),
                scale=scale,
                published=law is not None and law.published is not None and law.compared_form is not None,
            )
        )
    return found


def _expected(
    parameter: Parameter,
    temperature: float | None,
    law: LawTable | None,
    fmu: FmuDescription,
    coefficient: bool,
) -> float | None:
    if law is not None and law.published is not None and law.compared_form is not None:
        return (
            None
            if temperature is None
            else float(published_law(law.compared_form, law.published)(temperature))
        )
    if parameter.start is not None or coefficient:
        return parameter.start
    start = fmu.variable(parameter.variable).start
    return None if start is None else parameter.from_variable(start)
