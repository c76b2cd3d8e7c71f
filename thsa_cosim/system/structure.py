"""What a system of FMUs is: components, connections between their variables, connectors to the outside.

A variable of a component is named ``<component>.<variable>``; a connector of the system has a name of its own. Inputs
that nothing is connected to are inputs of the system.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from thsa_cosim.errors import FmuError, UnitError, did_you_mean
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.variable import Variable
from thsa_cosim.units import conversion

Execution = Literal["continuous", "coupled", "sampled"]
"""How a component goes on: integrated together with the others (Model Exchange), by communication steps of its own
solver (Co-Simulation), or as a sampled controller, which acts at its ticks only (Co-Simulation)."""


@dataclass(frozen=True)
class Component:
    """One FMU in its place."""

    name: str
    """Unique; with dots where it stands in a nested system."""
    fmu: FmuDescription
    source: str
    """Its archive's place in the SSP, e.g. ``resources/Plant.fmu``."""
    execution: Execution
    start: Mapping[str, float] = field(default_factory=dict)
    """Start values by variable, in the FMU's units."""
    step: float | None = None
    """Communication step or sampling interval [s]; None for ``continuous``."""
    delay: float = 0.0
    """Time from a tick until a sampled component's outputs change [s], at most one ``step``."""
    jitter: float = 0.0
    """A sampled component's ticks are late by up to so much [s], uniformly distributed; the same in every run."""
    process: Literal["shared", "own"] = "shared"
    """``own``: its FMU runs in a separate process in any case; otherwise where it cannot share one."""


@dataclass(frozen=True)
class Connection:
    """``target = factor * source + offset (+ disturbance)``; both are (component, variable)."""

    source: tuple[str, str]
    target: tuple[str, str]
    factor: float = 1.0
    offset: float = 0.0
    convert: bool = True
    """Whether units are still to be converted; False: factor and offset do it."""
    disturbance: str = ""
    """Name of an input of the system that is added to ``target``, in its unit; "" for none."""

    def __str__(self) -> str:
        return f"{'.'.join(self.source)} -> {'.'.join(self.target)}"


@dataclass(frozen=True)
class Connector:
    """A variable of the system itself: an input or parameter that drives those of components, or an output."""

    name: str
    causality: Literal["input", "output", "parameter"]
    pins: tuple[tuple[tuple[str, str], float, float], ...]
    """((component, variable), factor, offset). Input, parameter: pin = factor * connector + offset; output (one pin):
    connector = factor * pin + offset."""
    unit: str = ""
    description: str = ""
    convert: bool = True
    """As for a connection."""


@dataclass(frozen=True)
class System:
    """Components and how they are connected; ``checked`` makes a sound one."""

    name: str
    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    connectors: tuple[Connector, ...] = ()
    notes: tuple[str, ...] = field(default=(), compare=False)
    """What reading it left out, each in a sentence."""
    coupling_tolerance: float | None = None
    """Communication steps become as short as this needs: the error that they leave in any output over a run,
    as a share of its largest size. None: every component keeps its ``step``."""

    def component(self, name: str) -> Component:
        """Return a component; FmuError if there is none of that name."""
        for component in self.components:
            if component.name == name:
                return component
        names = [c.name for c in self.components]
        raise FmuError(
            f"the system has no component {name!r}; it has {', '.join(names)}.{did_you_mean(name, names)}"
        )

    def variable(self, pin: tuple[str, str]) -> Variable:
        """Return a component's variable; FmuError if there is none."""
        try:
            return self.component(pin[0]).fmu.variable(pin[1])
        except FmuError as error:
            raise FmuError(f"component {pin[0]!r}: {error}" if pin[0] else str(error)) from None


def qualified(component: str, variable: str) -> str:
    """Name of a component's variable in the system; a derivative stays one: ``der(plant.x)``."""
    if variable.startswith("der(") and variable.endswith(")"):
        return f"der({component}.{variable[4:-1]})"
    return f"{component}.{variable}"


def unit_conversion(source: Variable, target: Variable, where: str) -> tuple[float, float]:
    """Return (factor, offset) from the unit of ``source`` to that of ``target``; FmuError if there is none."""
    if not source.unit or not target.unit or source.unit == target.unit:
        return 1.0, 0.0
    try:
        return conversion(source.unit, target.unit)
    except UnitError as error:
        raise FmuError(
            f"connection {where}: {error} Or give the connection a factor and convert = false."
        ) from None


def checked(system: System) -> System:
    """Return the system with unit conversions in its connections; FmuError in one sentence if it is not sound.

    Sound: names are unique and known, sources are outputs (or locals), targets are inputs with one writer each,
    types go together, units convert, and every component has the interface and the step that it needs.
    """
    if not system.components:
        raise FmuError("the system has no component.")
    _unique([c.name for c in system.components], "component")
    _unique([c.name for c in system.connectors], "connector")
    for component in system.components:
        _check_component(component)
    _check_rollback(system)
    writers: dict[tuple[str, str], str] = {}
    connections = []
    for connection in system.connections:
        source, target = system.variable(connection.source), system.variable(connection.target)
        if source.causality in ("input", "independent"):
            raise FmuError(
                f"connection {connection}: its source is an {source.causality} variable, not an output."
            )
        _claim(connection.target, target, str(connection), writers)
        if source.is_float != target.is_float and source.is_float:
            raise FmuError(
                f"connection {connection}: {source.type} does not go into {target.type}; round it in a component."
            )
        factor, offset = (
            unit_conversion(source, target, str(connection)) if connection.convert else (1.0, 0.0)
        )
        connections.append(
            Connection(
                connection.source,
                connection.target,
                connection.factor * factor,
                factor * connection.offset + offset,
                convert=False,
                disturbance=_disturbance(connection, target),
            )
        )
    _unique(
        [*(c.disturbance for c in connections if c.disturbance), *(c.name for c in system.connectors)],
        "input",
    )
    connectors = tuple(_checked_connector(system, c, writers) for c in system.connectors)
    return replace(system, connections=tuple(connections), connectors=connectors)


def _disturbance(connection: Connection, target: Variable) -> str:
    if connection.disturbance and not target.is_float:
        raise FmuError(
            f"connection {connection}: a disturbance cannot be added to a {target.type}; leave it out."
        )
    return connection.disturbance


def _unique(names: Sequence[str], what: str) -> None:
    for name in names:
        if names.count(name) > 1:
            raise FmuError(f"two {what}s are named {name!r}; give each its own name.")


def _claim(
    pin: tuple[str, str],
    variable: Variable,
    writer: str,
    writers: dict[tuple[str, str], str],
    takes: Sequence[str] = ("input",),
) -> None:
    name = ".".join(pin)
    if variable.causality not in takes:
        raise FmuError(f"connection {writer}: {name} is no input but of causality {variable.causality!r}.")
    if pin in writers:
        raise FmuError(f"{name} has two writers, {writers[pin]} and {writer}; keep one.")
    writers[pin] = writer


def _checked_connector(
    system: System, connector: Connector, writers: dict[tuple[str, str], str]
) -> Connector:
    pins = []
    unit = connector.unit
    for pin, factor, offset in connector.pins:
        variable = system.variable(pin)
        if connector.causality != "output":
            takes = ("input",) if connector.causality == "input" else ("parameter", "input")
            _claim(pin, variable, f"connector {connector.name}", writers, takes)
        unit = unit or variable.unit or ""
        scale, shift = 1.0, 0.0
        if connector.convert and variable.unit and unit and variable.unit != unit:
            pair = (variable.unit, unit) if connector.causality == "output" else (unit, variable.unit)
            try:
                scale, shift = conversion(*pair)
            except UnitError as error:
                raise FmuError(f"connector {connector.name} - {'.'.join(pin)}: {error}") from None
        pins.append((pin, factor * scale, scale * offset + shift))
    if connector.causality == "output" and len(pins) != 1:
        raise FmuError(
            f"the output connector {connector.name} has {len(pins)} sources; connect one output to it."
        )
    return replace(connector, pins=tuple(pins), unit=unit, convert=False)


def _check_component(component: Component) -> None:
    fmu, name = component.fmu, component.name
    if fmu.fmi_version == "1.0":
        raise FmuError(f"component {name!r}: {fmu.path.name} is FMI 1.0; a system takes FMI 2.0 and 3.0.")
    if timed := [clock.name for clock in fmu.clocks if clock.is_timed]:
        raise FmuError(
            f"component {name!r}: {fmu.path.name} has clocks that the importer has to tick ({', '.join(timed)}), "
            "which a system does not do; export it without clocks and give it execution = 'sampled' with a step."
        )
    for variable in component.start:
        fmu.variable(variable)
    if component.execution == "continuous":
        if not fmu.supports_model_exchange:
            raise FmuError(
                f"component {name!r}: {fmu.path.name} has no Model Exchange; give it a step to run it by Co-Simulation."
            )
        if component.step is not None or component.delay:
            raise FmuError(
                f"component {name!r} is integrated with the others; step and delay are for Co-Simulation."
            )
        return
    if not fmu.supports_co_simulation:
        raise FmuError(f"component {name!r}: {fmu.path.name} has no Co-Simulation; leave its step out.")
    if component.step is None or not component.step > 0.0:
        raise FmuError(f"component {name!r} runs by Co-Simulation: give it a positive step in s.")
    if not 0.0 <= component.delay + component.jitter <= component.step:
        late = f"{component.delay:g} s" + (
            f" and the jitter of {component.jitter:g} s" if component.jitter else ""
        )
        raise FmuError(f"component {name!r}: the delay of {late} exceeds its step of {component.step:g} s.")
    if (component.delay or component.jitter) and component.execution != "sampled":
        raise FmuError(f"component {name!r}: only a sampled component has a delay or jitter.")


def _check_rollback(system: System) -> None:
    """A tolerance of the coupling needs components that can all go back, and that step together."""
    if system.coupling_tolerance is None:
        return
    first = system.components[0]
    for component in system.components:
        what = ""
        if component.execution != "coupled":
            what = f"is {component.execution}; a coupling tolerance needs execution = 'coupled' throughout"
        elif component.step != first.step:
            what = (
                f"steps by {component.step:g} s, {first.name!r} by {first.step:g} s; give all the same step"
            )
        elif not any(component.fmu.capabilities.get(f"canGetAndSetFMU{s}") for s in ("state", "State")):
            what = "cannot be put back to a former state (canGetAndSetFMUstate); leave coupling_tolerance out"
        elif not component.fmu.capabilities.get("canHandleVariableCommunicationStepSize"):
            what = "takes steps of one size only; leave coupling_tolerance out"
        if what:
            raise FmuError(f"component {component.name!r} {what}.")


def default_execution(fmu: FmuDescription, step: float | None) -> Execution:
    """Integrate what offers Model Exchange and has no step of its own; step the rest."""
    return "continuous" if fmu.supports_model_exchange and step is None else "coupled"


def connected_inputs(system: System) -> frozenset[tuple[str, str]]:
    """Return inputs (and parameters) of components that a connection or a connector writes."""
    pins: Iterable[tuple[str, str]] = (
        pin for c in system.connectors if c.causality != "output" for pin, *_ in c.pins
    )
    return frozenset(c.target for c in system.connections) | frozenset(pins)
