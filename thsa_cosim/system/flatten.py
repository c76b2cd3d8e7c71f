"""Nested systems of an SSP → one flat :class:`System`: connections followed through connectors, parameters placed."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from thsa_cosim.errors import FmuError, UnitError, did_you_mean
from thsa_cosim.system.nested import Bus, Element, Link, Nested
from thsa_cosim.system.parameters import Placement
from thsa_cosim.system.structure import (
    Component,
    Connection,
    Connector,
    Execution,
    System,
    checked,
    default_execution,
)
from thsa_cosim.system.unit_definitions import UnitDefinitions

_SENDS_OUTWARDS = ("output", "calculatedParameter", "constant", "local")
_TAKES = ("input", "parameter", "structuralParameter")


@dataclass(frozen=True)
class _Node:
    """A connector: of a component, of a nested system, of the whole (path empty), or a signal of a dictionary."""

    path: str
    name: str
    is_signal: bool = False

    def __str__(self) -> str:
        return f"{self.path}.{self.name}".strip(".")


@dataclass(frozen=True)
class _Way:
    """From one connector to another: end = factor * start + offset, units included."""

    start: _Node
    end: _Node
    factor: float
    offset: float
    disturbance: str = ""


def flattened(nested: Nested, definitions: UnitDefinitions | None = None) -> System:
    """Flatten and check; FmuError in one sentence where something does not fit."""
    return _Flat(nested, definitions or UnitDefinitions()).system()


class _Flat:
    """One flattening."""

    def __init__(self, nested: Nested, definitions: UnitDefinitions) -> None:
        self._nested, self._definitions = nested, definitions
        self._components = {c.name: c for c in _components(nested, "")}
        self._connectors = [_Node(path, name) for path, name, _ in _connectors(nested, "")]
        self._into: dict[_Node, _Way] = {}
        self._units = {_Node(path, name): unit for path, name, unit in _connectors(nested, "")}

    def system(self) -> System:
        directed = list(self._directed(self._nested, "", {}))
        self._infer_units(directed)
        for start, end, link in directed:
            if end in self._into:
                raise FmuError(f"{end} has two writers, {self._into[end].start} and {start}; keep one.")
            factor, offset = (1.0, 0.0) if link.suppress_units else self._conversion(start, end, link)
            factor, offset = link.factor * factor, link.factor * offset + link.offset
            self._into[end] = _Way(start, end, factor, offset, link.disturbance)
        units = {(node.path, node.name): self._unit(node) for node in self._connectors}
        fmus = {name: component.fmu for name, component in self._components.items()}
        placement = Placement(fmus, units, self._definitions)
        _place(self._nested, "", placement)
        connections = []
        takers: dict[_Node, list[_Way]] = {}
        for end in self._into:
            if end.path not in self._components:
                continue
            chain = self._chain(end)
            origin = chain[-1]
            if origin.start.path in self._components:
                source, target = (origin.start.path, origin.start.name), (end.path, end.name)
                disturbance = self._into[end].disturbance
                connections.append(
                    Connection(source, target, origin.factor, origin.offset, False, disturbance)
                )
                continue
            if origin.start.is_signal:
                continue  # a signal of a dictionary that nobody writes: the input stays open
            takers.setdefault(origin.start, []).append(origin)
            for way in reversed(chain):  # what is set furthest outside wins
                value = placement.connectors.get((way.start.path, way.start.name))
                if value is not None:
                    found = placement.starts.setdefault(end.path, {})
                    found[end.name] = way.factor * value + way.offset
                    break
        connectors = [self._taking(node, ways) for node, ways in takers.items()]
        connectors += self._shown()
        parts = [replace(c, start=placement.starts.get(c.name, {})) for c in self._components.values()]
        tolerance = self._nested.coupling_tolerance
        made = System(
            self._nested.name,
            tuple(parts),
            tuple(connections),
            tuple(connectors),
            coupling_tolerance=tolerance,
        )
        return replace(checked(made), notes=tuple(placement.notes))

    def _taking(self, node: _Node, ways: Sequence[_Way]) -> Connector:
        """A connector that drives components; one of a nested system that nothing is connected to keeps its path."""
        pins = tuple(((way.end.path, way.end.name), way.factor, way.offset) for way in ways)
        takers = {self._components[c].fmu.variable(v).causality for (c, v), *_ in pins}
        causality: Literal["input", "parameter"] = "input" if takers == {"input"} else "parameter"
        return Connector(str(node), causality, pins, self._unit(node), convert=False)

    def _shown(self) -> Iterator[Connector]:
        """The outputs of the whole."""
        for name, (kind, _) in self._nested.connectors.items():
            node = _Node("", name)
            if kind not in _TAKES and node in self._into:
                way = self._chain(node)[-1]
                if way.start.path in self._components:
                    pin = (way.start.path, way.start.name), way.factor, way.offset
                    yield Connector(name, "output", (pin,), self._unit(node), convert=False)

    def _chain(self, end: _Node) -> list[_Way]:
        """Ways to ``end`` from ever further back, each as a whole, through connectors and signals."""
        found: list[_Way] = []
        node, factor, offset = end, 1.0, 0.0
        seen = {end}
        while node in self._into:
            way = self._into[node]
            node = way.start
            factor, offset = factor * way.factor, factor * way.offset + offset
            found.append(_Way(node, end, factor, offset))
            if node.path in self._components:
                break
            if node in seen:
                raise FmuError(f"the connectors {node} and others feed each other in a circle; cut it.")
            seen.add(node)
        return found

    # -- connections ------------------------------------------------------------------------------------
    def _directed(
        self, system: Nested, path: str, above: Mapping[str, str]
    ) -> Iterator[tuple[_Node, _Node, Link]]:
        """Every connection from what sends to what takes; ``above``: owner of each signal dictionary."""
        owners = {**above, **dict.fromkeys(system.dictionaries, path)}
        for owner_name, signals in system.dictionaries.items():
            for signal, unit in signals.items():
                self._units[_Node(f"{path}\0{owner_name}", signal, is_signal=True)] = unit
        inside = {e.name: e for e in system.elements}
        for given in system.links:
            ends = [
                self._end(system, path, inside, owners, given, *end)
                for end in ((given.start_element, given.start), (given.end_element, given.end))
            ]
            (start, sends), (end, takes_not) = ends
            if sends is not None and sends == takes_not:
                what = "two that send" if sends else "two that take"
                raise FmuError(f"connection {given} joins {what}; one end has to send and the other to take.")
            if sends is False or (sends is None and takes_not):
                start, end = end, start
            yield start, end, given
        for element in system.elements:
            if isinstance(element, Nested):
                yield from self._directed(element, f"{path}.{element.name}".lstrip("."), owners)

    def _end(
        self,
        system: Nested,
        path: str,
        inside: "Mapping[str, Element | Nested | Bus]",
        owners: Mapping[str, str],
        link: Link,
        name: str,
        connector: str,
    ) -> tuple[_Node, bool | None]:
        """One end of a connection, and whether it sends; None where its kind leaves that open."""
        if name and name not in inside:
            raise FmuError(f"connection {link}: there is no element {name!r}.{did_you_mean(name, inside)}")
        found = inside.get(name)
        where = f"{path}.{name}".strip(".")
        if isinstance(found, Element):
            return _Node(where, connector), found.fmu.variable(connector).causality not in _TAKES
        if isinstance(found, Bus):
            if found.dictionary not in owners:
                raise FmuError(
                    f"{name!r} refers to the signal dictionary {found.dictionary!r}, which there is not."
                    f"{did_you_mean(found.dictionary, owners)}"
                )
            node = _Node(f"{owners[found.dictionary]}\0{found.dictionary}", connector, is_signal=True)
            if node not in self._units:
                signals = [n.name for n in self._units if n.path == node.path]
                raise FmuError(
                    f"connection {link}: the signal dictionary {found.dictionary!r} has no {connector!r}."
                    f"{did_you_mean(connector, signals)}"
                )
            return node, None
        known = system.connectors if found is None else found.connectors
        if connector not in known:
            raise FmuError(
                f"connection {link}: there is no connector {connector!r}.{did_you_mean(connector, known)}"
            )
        kind = known[connector][0]
        outwards = True if kind in _SENDS_OUTWARDS else False if kind in _TAKES else None
        if outwards is not None and found is None:
            outwards = not outwards  # seen from inside
        return _Node(where, connector), outwards

    def _unit(self, node: _Node) -> str:
        if node.path in self._components:
            return self._components[node.path].fmu.variable(node.name).unit or ""
        return self._units.get(node, "")

    def _infer_units(self, directed: Sequence[tuple[_Node, _Node, Link]]) -> None:
        """A connector without a unit takes that of what it is plainly connected to."""
        plain = [
            (start, end)
            for start, end, link in directed
            if not link.suppress_units and link.factor == 1.0 and link.offset == 0.0
        ]
        for _ in plain:
            before = dict(self._units)
            for pair in plain:
                for known, open_end in (pair, pair[::-1]):
                    if open_end in self._units and not self._units[open_end]:
                        self._units[open_end] = self._unit(known)
            if before == self._units:
                return

    def _conversion(self, start: _Node, end: _Node, link: Link) -> tuple[float, float]:
        a, b = self._unit(start), self._unit(end)
        if not a or not b or a == b:
            return 1.0, 0.0
        try:
            return self._definitions.conversion(a, b)
        except UnitError as error:
            raise FmuError(
                f"connection {link}: {error} Or set suppressUnitConversion and a LinearTransformation."
            ) from None


def _components(nested: Nested, path: str) -> Iterator[Component]:
    for element in nested.elements:
        name = f"{path}{element.name}"
        if isinstance(element, Nested):
            yield from _components(element, f"{name}.")
        elif isinstance(element, Element):
            yield Component(
                name,
                element.fmu,
                element.source,
                _execution(element),
                {},
                _step(element),
                element.delay,
                element.jitter,
                element.process,
            )


def _connectors(nested: Nested, path: str) -> Iterator[tuple[str, str, str]]:
    """Yield path, name and unit of every connector of every system."""
    for name, (_, unit) in nested.connectors.items():
        yield path, name, unit
    for element in nested.elements:
        if isinstance(element, Nested):
            yield from _connectors(element, f"{path}.{element.name}".lstrip("."))


def _place(nested: Nested, path: str, placement: Placement) -> None:
    """Place all bindings, those of an outer system after those of its elements, so that they win (SSP 1.0, 5.3.2)."""
    for element in nested.elements:
        where = f"{path}.{element.name}".lstrip(".")
        if isinstance(element, Nested):
            _place(element, where, placement)
        elif isinstance(element, Element):
            for binding in element.bindings:
                placement.place(binding, where)
    for binding in nested.bindings:
        placement.place(binding, path)


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
