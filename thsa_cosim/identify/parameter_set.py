"""What was identified as FMU start values: the laws' coefficients, or the one value there is."""

from collections.abc import Mapping, Sequence

import numpy as np

from thsa_cosim.fmu import FmuDescription
from thsa_cosim.identify.results import LawResult, PointResult
from thsa_cosim.laws import Law, largest_deviation
from thsa_cosim.parameters import Parameter, ParameterSpace
from thsa_cosim.ssv import ParameterSet

_COEFFICIENTS = ("a0", "a1", "a2", "a3", "alpha1", "beta1", "alpha2", "beta2")


def law_block(variable: str, fmu: FmuDescription) -> str | None:
    """The ``TemperatureLaw`` block whose constant coefficient ``variable`` is, or None."""
    block, _, last = variable.rpartition(".")
    complete = all(f"{block}.{name}" in fmu.variables for name in _COEFFICIENTS)
    return block if last == "a0" and complete else None


def point_values(parameter: Parameter, value: float, fmu: FmuDescription) -> dict[str, float]:
    """Start values that make ``parameter`` equal ``value`` (its unit) at every temperature."""
    own = parameter.to_variable(value)
    block = law_block(parameter.variable, fmu)
    return {parameter.variable: own} if block is None else Law("constant", (own,)).block_values(block)


def law_values(parameter: Parameter, law: Law, fmu: FmuDescription) -> dict[str, float] | None:
    """Start values of the block that holds ``law``; None if the FMU or the form has no such block."""
    block = law_block(parameter.variable, fmu)
    proportional = parameter.to_variable(0.0) == 0.0
    if block is None or not law.fits_block or not proportional:
        return None
    factor = parameter.to_variable(1.0)
    values = law.block_values(block)
    return {name: value if ".beta" in name else value * factor for name, value in values.items()}


def _held(law: LawResult) -> Law:
    """The law itself, or for a Vogel law the best of its candidates that a ``TemperatureLaw`` block can hold."""
    able = (c for c in law.candidates if c.fits_block)
    return next(able, law.law) if law.law.form == "vogel" else law.law


def parameter_set(
    name: str,
    space: ParameterSpace,
    points: Sequence[PointResult],
    laws: Mapping[str, LawResult],
    fmu: FmuDescription,
) -> tuple[ParameterSet, list[str]]:
    """Everything identified as start values in the FMU's units, and one sentence per parameter left out."""
    values: dict[str, float] = {}
    notes: list[str] = []
    together = {name for combination in space.combinations for name in combination.members}
    for parameter in (p for p in space.parameters if p.name not in together):
        found = [p.parameters[parameter.name] for p in points if parameter.name in p.parameters]
        law = laws.get(parameter.name)
        held = None if law is None else _held(law)
        from_law = None if held is None else law_values(parameter, held, fmu)
        if from_law is not None and held is not None and law is not None:
            if held is not law.law:
                t = np.array([p.temperature_degC for p in points if p.temperature_degC is not None])
                notes.append(
                    f"{parameter.name} is in the parameter set as a {held.form} law, because a TemperatureLaw block"
                    f" holds no {law.law.form} law: up to {100 * largest_deviation(held, law.law, t):.2g} % away."
                )
            values.update(from_law)
        elif len(found) == 1:
            values.update(point_values(parameter, found[0].value, fmu))
        elif found:
            notes.append(
                f"{parameter.name} is not in the parameter set: it has several values and no law that"
                f" {fmu.path.name} can hold."
            )
    for combination in space.combinations if len(points) == 1 else ():
        values |= combination.assignments({n: points[0].parameters[n].value for n in combination.members})
    units = {v: fmu.variables[v].unit or "" for v in values if v in fmu.variables}
    return ParameterSet(name, values, units, "identified by thsa-cosim"), notes
