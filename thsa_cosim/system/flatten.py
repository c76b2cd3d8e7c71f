"""Nested systems of an SSP → one flat :class:`System`: connections followed through connectors, parameters placed."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from thsa_cosim.errors import FmuError, UnitError, did_you_mean
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.system.structure import (
    Component,
    Connection,
    Connector,
    Execution,
    System,
    checked,
    default_execution,
)
from thsa_cosim.units import conversion


@dataclass(frozen=True)
class Binding:
    """Parameter values for an element and what it contains (SSP 1.0, 5.3.2)."""

    prefix: str
    values: Mapping[str, float]
    units: Mapping[str, str]
    mapping: Mapping[str, tuple[str, float, float]] | None = None
    """Target → (source, factor, offset); None: names are targets."""

    def entries(self) -> Iterator[tuple[str, float, str]]:
        """Yield (target, value, unit)."""
        if self.mapping is None:
            for name, value in self.values.items():
                yield self.prefix + name, value, self.units.get(name, "")
            return
        for target, (source, factor, offset) in self.mapping.items():
            if source not in self.values:
                raise FmuError(
                    f"a parameter mapping names {source!r}, which its values lack.{did_you_mean(source, self.values)}"
                )
            is_plain = factor == 1.0 and offset == 0.0
            value = factor * self.values[source] + offset
            yield self.prefix + target, value, self.units.get(source, "") if is_plain else ""


@dataclass(frozen=True)
class Link:
    """A connection as it stands in the file; an empty element is the system itself."""

    start_element: str
    start: str
    end_element: str
    end: str
    factor: float = 1.0
    offset: float = 0.0
    suppress_units: bool = False
    disturbance: str = ""

    def __str__(self) -> str:
        start = f"{self.start_element}.{self.start}" if self.start_element else self.start
        end = f"{self.end_element}.{self.end}" if self.end_element else self.end
        return f"{start} -> {end}"


@dataclass(frozen=True)
class Element:
    """A component as it stands in the file."""

    name: str
    fmu: FmuDescription
    source: str
    bindings: tuple[Binding, ...] = ()
    execution: str = ""
    step: float | None = None
    delay: float = 0.0
    jitter: float = 0.0


@dataclass(frozen=True)
class Nested:
    """A system as it stands in the file."""

    name: str
    elements: "tuple[Element | Nested, ...]"
    links: tuple[Link, ...]
    connectors: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """Kind ("input", "output", "parameter", …) and unit by name."""
    bindings: tuple[Binding, ...] = ()


@dataclass(frozen=True)
class _Node:
    """A connector: of a component, or of a nested system, or of the whole (path empty)."""

    path: str
    name: str


@dataclass(frozen=True)
class _Way:
    """From one connector to another: end = factor * start + offset, then units where ``convert`` says so."""

    start: _Node
    end: _Node
    factor: float
    offset: float
    convert: bool
    disturbance: str = ""


def flattened(nested: Nested) -> System:
    """Flatten and check; FmuError in one sentence where something does not fit."""
    components = list(_components(nested, ""))
    starts = _starts(nested, {c.name: c.fmu for c in components})
    components = [replace(c, start=starts.get(c.name, {})) for c in components]
    links = list(_links(nested, ""))
    names = {c.name for c in components}
    into: dict[_Node, list[_Way]] = {}
    for way in links:
        into.setdefault(way.end, []).append(way)
    for end, writers in into.items():
        if len(writers) > 1:
            shown = " and ".join(f"{w.start.path}.{w.start.name}".strip(".") for w in writers)
            raise FmuError(f"{end.path}.{end.name}".strip(".") + f" has two writers, {shown}; keep one.")
    connections = []
    inputs: dict[str, list[_Way]] = {}
    for end in into:
        if end.path not in names:
            continue
        way = _origin(end, into, names)
        if way.start.path in names:
            source, target = (way.start.path, way.start.name), (end.path, end.name)
            connections.append(
                Connection(source, target, way.factor, way.offset, way.convert, way.disturbance)
            )
        elif way.start.path == "":
            inputs.setdefault(way.start.name, []).append(way)
        else:
            where = f"{way.start.path}.{way.start.name}"
            raise FmuError(f"nothing is connected to {where}, which {end.path}.{end.name} takes; connect it.")
    connectors = [_connector(nested, name, "input", ways) for name, ways in inputs.items()]
    for name, (kind, _) in nested.connectors.items():
        if kind == "output" and _Node("", name) in into:
            way = _origin(_Node("", name), into, names)
            if way.start.path in names:
                connectors.append(_connector(nested, name, "output", [way]))
    return checked(System(nested.name, tuple(components), tuple(connections), tuple(connectors)))


def _connector(
    nested: Nested, name: str, causality: Literal["input", "output"], ways: "list[_Way]"
) -> Connector:
    pins = []
    for way in ways:
        node = way.end if causality == "input" else way.start
        pins.append(((node.path, node.name), way.factor, way.offset))
    unit = nested.connectors.get(name, ("", ""))[1]
    return Connector(name, causality, tuple(pins), unit, convert=all(way.convert for way in ways))


def _components(nested: Nested, path: str) -> Iterator[Component]:
    for element in nested.elements:
        name = f"{path}{element.name}"
        if isinstance(element, Nested):
            yield from _components(element, f"{name}.")
            continue
        yield Component(
            name,
            element.fmu,
            element.source,
            _execution(element),
            {},
            _step(element),
            element.delay,
            element.jitter,
        )


def _execution(element: Element) -> Execution:
    if element.execution in ("continuous", "coupled", "sampled"):
        return element.execution  # type: ignore[return-value]
    if element.execution:
        raise FmuError(
            f"component {element.name!r} is to run {element.execution!r}; choose continuous, coupled or sampled."
        )
    return default_execution(element.fmu, element.step)


def _step(element: Element) -> float | None:
    """Its own step, or the one that a Co-Simulation FMU suggests."""
    if element.step is not None or _execution(element) == "continuous":
        return element.step
    return element.fmu.default_experiment.step or 1e-3


def _links(nested: Nested, path: str) -> Iterator[_Way]:
    inside = {e.name: e for e in nested.elements}
    for link in nested.links:
        ends = []
        for name, connector in ((link.start_element, link.start), (link.end_element, link.end)):
            if name and name not in inside:
                raise FmuError(
                    f"connection {link}: there is no element {name!r}.{did_you_mean(name, inside)}"
                )
            found = inside.get(name)
            if isinstance(found, Element):
                found.fmu.variable(connector)
            known = nested.connectors if not name else found.connectors if isinstance(found, Nested) else None
            if known is not None and connector not in known:
                raise FmuError(
                    f"connection {link}: there is no connector {connector!r}.{did_you_mean(connector, known)}"
                )
            ends.append(_Node(f"{path}{name}" if name else path.rstrip("."), connector))
        yield _Way(ends[0], ends[1], link.factor, link.offset, not link.suppress_units, link.disturbance)
    for element in nested.elements:
        if isinstance(element, Nested):
            yield from _links(element, f"{path}{element.name}.")


def _origin(end: _Node, into: Mapping[_Node, list[_Way]], names: set[str]) -> _Way:
    """Follow connectors of nested systems back to a component's output or a connector of the whole."""
    node, factor, offset, convert = end, 1.0, 0.0, True
    disturbance = into[end][0].disturbance if end in into else ""
    seen = {end}
    while node in into:
        way = into[node][0]
        node, convert = way.start, convert and way.convert
        factor, offset = factor * way.factor, factor * way.offset + offset
        if node.path in names:
            break
        if node in seen:
            raise FmuError(
                f"the connectors {node.path}.{node.name} and others feed each other in a circle; cut it."
            )
        seen.add(node)
    return _Way(node, end, factor, offset, convert, disturbance)


def _starts(
    nested: Nested, fmus: Mapping[str, FmuDescription], path: str = ""
) -> dict[str, dict[str, float]]:
    """Start values by component: those of an outer system win over those of an inner element (SSP 1.0, 5.3.2)."""
    found: dict[str, dict[str, float]] = {}
    for element in nested.elements:
        name = f"{path}{element.name}"
        if isinstance(element, Nested):
            for component, values in _starts(element, fmus, f"{name}.").items():
                found.setdefault(component, {}).update(values)
            continue
        for binding in element.bindings:
            for target, value, unit in binding.entries():
                found.setdefault(name, {})[target] = _in_unit(fmus[name], target, value, unit)
    for binding in nested.bindings:
        for target, value, unit in binding.entries():
            component, variable = _owner(path + target, fmus)
            found.setdefault(component, {})[variable] = _in_unit(fmus[component], variable, value, unit)
    return found


def _owner(name: str, fmus: Mapping[str, FmuDescription]) -> tuple[str, str]:
    for component in fmus:
        if name.startswith(component + "."):
            return component, name[len(component) + 1 :]
    raise FmuError(
        f"a parameter binding sets {name!r}, but there is no such component.{did_you_mean(name.split('.')[0], fmus)}"
    )


def _in_unit(fmu: FmuDescription, name: str, value: float, unit: str) -> float:
    wanted = fmu.variable(name).unit
    if not unit or not wanted or unit == wanted:
        return value
    try:
        factor, offset = conversion(unit, wanted)
    except UnitError as error:
        raise FmuError(f"parameter {name}: {error}") from None
    return factor * value + offset
