"""A system as an FMU describes itself, so that it can stand where an FMU stands."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from thsa_cosim.fmu.description import DefaultExperiment, FmuDescription
from thsa_cosim.fmu.variable import Variable
from thsa_cosim.system.order import stages
from thsa_cosim.system.structure import System, connected_inputs, qualified

DISTURBANCE = ""
"""In place of a component, in the pin of an input that is added to a connection's target."""


@dataclass(frozen=True)
class SystemDescription(FmuDescription):
    """Description of a system: its variables are ``<component>.<variable>`` and its connectors."""

    system: System = field(default_factory=lambda: System("", (), ()))
    pins: Mapping[str, tuple[tuple[tuple[str, str], float, float], ...]] = field(default_factory=dict)
    """What a name stands for: ((component, variable), factor, offset), for inputs and parameters from the name to the
    pin, for all others from the pin to the name."""


def describe_system(
    system: System, path: Path, sha256: str, experiment: DefaultExperiment
) -> SystemDescription:
    """Describe a checked system that the archive ``path`` with digest ``sha256`` holds."""
    variables: dict[str, Variable] = {}
    pins: dict[str, tuple[tuple[tuple[str, str], float, float], ...]] = {}
    written = connected_inputs(system)

    def add(
        name: str, variable: Variable, stands_for: tuple[tuple[tuple[str, str], float, float], ...]
    ) -> None:
        variables[name] = replace(variable, name=name, value_reference=len(variables), is_alias=False)
        pins[name] = stands_for

    for connector in system.connectors:
        pin, factor, offset = connector.pins[0]
        variable = system.variable(pin)
        start = system.component(pin[0]).start.get(pin[1], variable.start)
        if start is not None:
            is_output = connector.causality == "output"
            start = factor * start + offset if is_output else (start - offset) / factor if factor else None
        shown = replace(
            variable,
            causality=connector.causality,
            unit=connector.unit or variable.unit,
            description=connector.description or variable.description,
            start=start,
            minimum=None,
            maximum=None,
        )
        add(connector.name, shown, connector.pins)
    for connection in system.connections:
        if connection.disturbance:
            shown = replace(
                system.variable(connection.target),
                causality="input",
                description=f"added to {'.'.join(connection.target)}",
                start=0.0,
                minimum=None,
                maximum=None,
            )
            add(connection.disturbance, shown, (((DISTURBANCE, ".".join(connection.target)), 1.0, 0.0),))
    for component in system.components:
        for variable in component.fmu.variables.values():
            pin = (component.name, variable.name)
            causality = variable.causality
            if causality == "independent":
                continue
            if pin in written:
                causality = "local"
            start = component.start.get(variable.name, variable.start)
            add(qualified(*pin), replace(variable, causality=causality, start=start), ((pin, 1.0, 0.0),))
    continuous = [c for c in system.components if c.execution == "continuous"]
    platforms = set.intersection(*(set(c.fmu.platforms) for c in system.components))
    return SystemDescription(
        path=path,
        sha256=sha256,
        model_name=system.name,
        fmi_version="2.0",
        tool="a system of "
        + ", ".join(dict.fromkeys(c.fmu.tool or c.fmu.model_name for c in system.components)),
        guid="",
        supports_co_simulation=False,
        supports_model_exchange=True,
        capabilities={
            "needsCompletedIntegratorStep": any(
                c.fmu.capabilities.get("needsCompletedIntegratorStep", True) for c in continuous
            ),
            "providesDirectionalDerivative": bool(continuous)
            and all(_has_jacobian(c.fmu) for c in continuous),
        },
        variables=variables,
        default_experiment=experiment,
        platforms=tuple(sorted(platforms)),
        states=sum(c.fmu.states for c in continuous),
        event_indicators=sum(c.fmu.event_indicators for c in continuous),
        system=system,
        pins=pins,
    )


def _has_jacobian(fmu: FmuDescription) -> bool:
    known = fmu.capabilities.get("providesDirectionalDerivative")
    return bool(known) and len(fmu.state_references) == fmu.states


def loops(system: System) -> list[str]:
    """Algebraic loops of a system, each as a line of its outputs."""
    return [", ".join(".".join(pin) for pin in s.sources) for s in stages(system) if s.is_loop]
