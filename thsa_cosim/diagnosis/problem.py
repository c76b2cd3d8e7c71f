"""Scenario → recordings as trials, declared parameters as unknowns with what the drawing says of them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from thsa_cosim.diagnosis.bench import Trial
from thsa_cosim.diagnosis.unknowns import Unknown, Unknowns
from thsa_cosim.errors import ScenarioError
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.identify.problem import build_case
from thsa_cosim.laws import published_law
from thsa_cosim.parameters import Parameter
from thsa_cosim.scenario import DiagnoseSpec, Scenario

_LAW = ("a0", "a1", "a2", "a3", "alpha1", "beta1", "alpha2", "beta2")


def spec_of(scenario: Scenario) -> DiagnoseSpec:
    """The scenario's ``[diagnose]``; ScenarioError for a scenario of another kind or without held-out recordings."""
    if scenario.diagnose is None:
        raise ScenarioError(
            f"{scenario.path} is a scenario of kind {scenario.kind!r}; a diagnosis needs kind = 'diagnose'."
        )
    if not scenario.validate:
        raise ScenarioError(
            f"{scenario.path}: recordings.validate names no recording; a diagnosis is judged by recordings that no fit"
            " touched, so add one (or --validate FILE)."
        )
    return scenario.diagnose


def group_of(temperature: float | None, round_to: float) -> str:
    """Label of the recordings that share a temperature."""
    return "all" if temperature is None else f"{round(temperature / round_to) * round_to + 0.0:.6g} degC"


def trials_of(scenario: Scenario) -> tuple[Trial, ...]:
    """Every recording as a simulation of the scenario's own FMU."""
    trials = []
    for part, recordings in (("fit", scenario.fit), ("validate", scenario.validate)):
        for recording in recordings:
            case = build_case(scenario, recording, scenario.fixed_for(recording.name))
            group = group_of(recording.temperature_degC, scenario.round_to)
            trials.append(Trial(case, "fit" if part == "fit" else "validate", group))
    known = {t.group for t in trials if t.part == "fit"}
    for trial in trials:
        if trial.group not in known:
            raise ScenarioError(
                f"{trial.case.name} was recorded at {trial.group}, where there is no fit recording; add one, or"
                " leave it out."
            )
    return tuple(trials)


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


def with_fmu(
    trials: tuple[Trial, ...], fmu: Path, fixed: Mapping[str, float] | None = None
) -> tuple[Trial, ...]:
    """The same recordings driving another FMU, with further fixed start values."""
    from dataclasses import replace

    return tuple(
        replace(t, case=replace(t.case, fmu=fmu, fixed={**t.case.fixed, **(fixed or {})})) for t in trials
    )
