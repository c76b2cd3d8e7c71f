"""The declared parameters as unknowns, with what the drawing says of them."""

import numpy as np

from thsa_cosim.diagnosis.fitting.trials import Trial, spec_of
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns
from thsa_cosim.errors import ScenarioError
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.laws import published_law
from thsa_cosim.parameters import Parameter
from thsa_cosim.scenario import Scenario

_LAW = ("a0", "a1", "a2", "a3", "alpha1", "beta1", "alpha2", "beta2")


def declared_unknowns(scenario: Scenario, trials: tuple[Trial, ...]) -> Unknowns:
    """The scenario's parameters about the drawing: one each, or one per temperature where a law gives it.

    The drawing's value is ``start``, else the published law, else the FMU's own law or start value, at the temperature.
    """
    spec = spec_of(scenario)
    temperatures: dict[str, float | None] = {}
    for trial in trials:
        temperatures.setdefault(trial.group, trial.case.temperature_degC)
    members = []
    for p in scenario.parameters.parameters:
        block = _law_block(scenario.fmu, p.variable)
        published = scenario.laws[p.name].published if p.name in scenario.laws else None
        several = len(temperatures) > 1 and (block is not None or published is not None)
        for group, temperature in temperatures.items() if several else (next(iter(temperatures.items())),):
            members.append(
                _unknown(scenario, p, block, temperature, spec.spreads[p.name], group if several else None)
            )
    return Unknowns(tuple(members))


def _unknown(
    scenario: Scenario,
    p: Parameter,
    block: str | None,
    temperature: float | None,
    spread: float,
    group: str | None,
) -> Unknown:
    at_zero = _start_value(scenario, p.variable)
    inherited = at_zero if block is None or temperature is None else _law_value(scenario, block, temperature)
    value = inherited
    law = scenario.laws.get(p.name)
    if p.start is not None:
        value = p.to_variable(p.start)
    elif (
        law is not None
        and law.published is not None
        and law.published_form is not None
        and temperature is not None
    ):
        at = published_law(law.published_form, law.published)(np.array([temperature]))[0]
        value = p.to_variable(float(at))
    lower, upper = sorted((p.to_variable(p.lower), p.to_variable(p.upper)))
    if not lower < value < upper:
        raise ScenarioError(
            f"{scenario.path}: parameter {p.name!r} is {p.from_variable(value):.6g} {p.unit} on the drawing,"
            f" outside its bounds {p.lower:g} to {p.upper:g}; widen them."
        )
    size = spread * (abs(value) or upper - lower)
    return Unknown(
        name=p.name if group is None else f"{p.name} at {group}",
        variable=p.variable,
        unit=p.unit,
        start=value,
        spread=size,
        scale=size,
        lower=lower,
        upper=upper,
        group=group,
        offset=at_zero - inherited,
    )


def _law_block(fmu: FmuDescription, variable: str) -> str | None:
    """``motor.R_s`` for ``motor.R_s.a0``, if it has a law's coefficients."""
    block, _, coefficient = variable.rpartition(".")
    has_all = all(f"{block}.{name}" in fmu.variables for name in _LAW)
    return block if coefficient == "a0" and has_all else None


def _start_value(scenario: Scenario, variable: str) -> float:
    fixed = scenario.fixed.get(variable)
    start = scenario.fmu.variables[variable].start if fixed is None else fixed
    return float(start) if isinstance(start, int | float) else 0.0


def _law_value(scenario: Scenario, block: str, temperature: float) -> float:
    c = {name: _start_value(scenario, f"{block}.{name}") for name in _LAW}
    polynomial = sum(c[f"a{k}"] * temperature**k for k in range(4))
    return float(polynomial + sum(c[f"alpha{k}"] * np.exp(c[f"beta{k}"] * temperature) for k in (1, 2)))
