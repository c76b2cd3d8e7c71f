"""Parameter bindings of an SSP: which value goes to which variable of which component, in its unit.

Names are hierarchical (SSP 1.0, section 5.3.2): ``<element>.<variable>`` seen from the system that the binding belongs
to, or the name of a connector of that system or of a system within it. A value whose name fits nothing is ignored, as
the standard asks; it is noted. A mapping that names what there is not is an error.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from thsa_cosim.errors import FmuError, UnitError, did_you_mean
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.variable import Variable
from thsa_cosim.system.unit_definitions import UnitDefinitions


@dataclass(frozen=True)
class Mapped:
    """Where a parameter mapping takes a value from: target = factor * source + offset, after units are converted."""

    source: str
    factor: float = 1.0
    offset: float = 0.0
    suppress_units: bool = False


@dataclass(frozen=True)
class Binding:
    """Parameter values for an element and what it contains."""

    prefix: str
    values: Mapping[str, float]
    units: Mapping[str, str]
    mapping: Mapping[str, Mapped] | None = None
    """By target; None: names are targets."""
    source: str = "a parameter binding"
    """What messages call it."""
    others: Mapping[str, str] = field(default_factory=dict)
    """Types of the values that are no numbers (String, Enumeration, Binary), by name."""
    texts: Mapping[str, str] = field(default_factory=dict)
    """Values of those that are a String or the name of an item of an Enumeration."""

    def entries(self) -> Iterator["Entry"]:
        """Yield what the binding gives, with targets as seen from its element."""
        if self.mapping is None:
            for name in (*self.values, *self.others):
                yield self._entry(name, Mapped(name), is_mapped=False)
            return
        known = {*self.values, *self.others}
        for target, mapped in self.mapping.items():
            if not mapped.source:
                continue  # tools write targets that nothing is mapped to yet
            if mapped.source not in known:
                raise FmuError(
                    f"a parameter mapping names {mapped.source!r}, which its values lack."
                    f"{did_you_mean(mapped.source, known)}"
                )
            yield self._entry(target, mapped, is_mapped=True)

    def _entry(self, target: str, mapped: Mapped, is_mapped: bool) -> "Entry":
        name = mapped.source
        unit = "" if mapped.suppress_units else self.units.get(name, "")
        return Entry(self.prefix + target, self.values.get(name), unit, mapped, is_mapped, self)


@dataclass(frozen=True)
class Entry:
    """One value on its way."""

    target: str
    value: float | None
    """None: it is no number."""
    unit: str
    mapped: Mapped
    is_mapped: bool
    binding: Binding

    def number(
        self,
        target: str,
        unit: str | None,
        definitions: UnitDefinitions,
        variable: Variable | None = None,
    ) -> float:
        """The value in ``unit``; FmuError if it does not convert, or is no number and no item of ``variable``."""
        value, items = self.value, () if variable is None else variable.items
        if value is None and variable is not None and variable.type == "Enumeration":
            value = variable.item(self.binding.texts.get(self.mapped.source, ""))
        if value is None:
            kind = self.binding.others[self.mapped.source]
            remedy = f"give one of {', '.join(name for name, _ in items)}" if items else "so leave it out"
            if kind == "String":
                remedy += "; a text goes into [fixed] of the scenario"
            raise FmuError(
                f"{self.binding.source}: {self.target!r} holds {kind}; only numbers can be set, {remedy}."
            )
        if self.unit and unit and unit != self.unit:
            try:
                factor, offset = definitions.conversion(self.unit, unit)
            except UnitError as error:
                raise FmuError(f"parameter {target}: {error}") from None
            value = factor * value + offset
        return self.mapped.factor * value + self.mapped.offset


class Placement:
    """Values placed so far: ``starts`` of components, and values of ``connectors`` of systems."""

    def __init__(
        self,
        fmus: Mapping[str, FmuDescription],
        connectors: Mapping[tuple[str, str], str],
        definitions: UnitDefinitions,
    ) -> None:
        """``fmus`` by component; ``connectors``: units by (path of the system, name)."""
        self._fmus, self._connectors, self._definitions = fmus, connectors, definitions
        self.starts: dict[str, dict[str, float]] = {}
        self.connectors: dict[tuple[str, str], float] = {}
        self.notes: list[str] = []

    def place(self, binding: Binding, path: str) -> None:
        """Place what a binding gives to the element ``path`` ("" for the whole); later values replace earlier ones."""
        for entry in binding.entries():
            name = f"{path}.{entry.target}" if path else entry.target
            if (pin := self._component_variable(name)) is not None:
                component, variable = pin
                found = self._fmus[component].variable(variable)
                value = entry.number(variable, found.unit, self._definitions, found)
                self.starts.setdefault(component, {})[variable] = value
            elif (connector := self._connector(name)) is not None:
                unit = self._connectors[connector]
                self.connectors[connector] = entry.number(name, unit, self._definitions)
            else:
                self._unknown(entry, name)

    def _component_variable(self, name: str) -> tuple[str, str] | None:
        for component, fmu in self._fmus.items():
            if name.startswith(component + ".") and name[len(component) + 1 :] in fmu.variables:
                return component, name[len(component) + 1 :]
        return None

    def _connector(self, name: str) -> tuple[str, str] | None:
        candidates = [("", name)] + [
            (name[:k], name[k + 1 :]) for k, letter in enumerate(name) if letter == "."
        ]
        return next((c for c in candidates if c in self._connectors), None)

    def _unknown(self, entry: Entry, name: str) -> None:
        owner = next((c for c in self._fmus if name.startswith(c + ".")), "")
        if owner:
            hint = did_you_mean(name[len(owner) + 1 :], self._fmus[owner].variables)
        else:
            known = [*self._fmus, *(".".join(c).lstrip(".") for c in self._connectors)]
            hint = did_you_mean(name, known) or did_you_mean(name.split(".")[0], known)
        if entry.is_mapped:
            raise FmuError(f"a parameter mapping sets {name!r}, but there is no such variable.{hint}")
        self.notes.append(f"{entry.binding.source}: nothing is named {name!r}, so it is ignored.{hint}")
