"""Classes as they are after inheritance, modification and redeclaration, and their instances.

A ``Scope`` is a class together with the scope it was declared in and the modifications that apply to it. A scope with
a ``path`` is a component of the model. Elements are looked up and components are made when they are asked for.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from thsa_cosim.errors import ModelicaError, did_you_mean
from thsa_cosim.modelica.library import Library
from thsa_cosim.modelica.modifier import Binding, Modifier, merge, modifier
from thsa_cosim.modelica.redeclaration import check_replaceable, constraint
from thsa_cosim.modelica.syntax import ClassDefinition, Component, Extends, Import

BUILTIN_TYPES = frozenset(("Real", "Integer", "Boolean", "String", "ExternalObject", "Clock"))
_LITERALS = {
    "StateSelect": ("never", "avoid", "default", "prefer", "always"),
    "AssertionLevel": ("error", "warning"),
}
_PREDEFINED = {
    name: ClassDefinition(name, "type", Path("Modelica"), 0, literals=literals)
    for name, literals in _LITERALS.items()
}


class Element(NamedTuple):
    """A declaration with the scope that its names belong to and what is said about it from outside."""

    declaration: Component | ClassDefinition
    owner: Scope
    modifier: Modifier | None


@dataclass(eq=False, slots=True)
class Variable:
    """A scalar of a built-in type; ``attributes`` are the bindings of start, fixed, unit, …"""

    name: str
    type: str
    variability: str
    prefixes: frozenset[str]
    description: str
    binding: Binding | None
    attributes: dict[str, Binding]
    final: bool
    place: str
    scope: Scope
    enumeration: tuple[str, ...] = ()
    value: Any = None
    state: int = 0  # of the evaluation of value: 0 = not yet, 1 = under way, 2 = done


class Disabled:
    """A component whose condition is false."""


DISABLED = Disabled()


@dataclass(eq=False)
class World:
    """What all scopes of one translation share."""

    library: Library
    instances: list[Scope] = field(default_factory=list)
    variables: dict[str, Variable] = field(default_factory=dict)
    structural: set[str] = field(default_factory=set)
    tunable: set[str] = field(default_factory=set)  # Boolean and Integer parameters that stay open
    folded: bool = False  # none of them does
    warned: set[str] = field(default_factory=set)  # texts of warnings given
    definitions: dict[int, Scope] = field(default_factory=dict)

    def top(self, name: str) -> Scope | None:
        """A top-level class."""
        definition = self.library.top(name) or _PREDEFINED.get(name)
        if definition is None:
            return None
        if id(definition) not in self.definitions:
            self.definitions[id(definition)] = Scope(self, definition, None, None)
        return self.definitions[id(definition)]


class Scope:
    """See the module."""

    def __init__(
        self,
        world: World,
        definition: ClassDefinition,
        parent: Scope | None,
        given: Modifier | None,
        *,
        path: str | None = None,
        container: Scope | None = None,
        derived: Scope | None = None,
        prefixes: frozenset[str] = frozenset(),
        original: tuple[ClassDefinition, Scope | None] | None = None,
    ) -> None:
        self.world = world
        self.definition = definition
        self.parent = parent
        self.given = given
        self.path = path
        self.container = container
        self.instance: Scope = derived.instance if derived else self
        self.prefixes = prefixes
        self.original = original  # what a "redeclare class extends" extends
        self.nodes: dict[str, Any] = {}
        self.bases: list[Scope] = []
        self.builtin: tuple[str, Modifier | None] | None = None
        self._elements: dict[str, Element] | None = None
        self._classes: dict[str, Scope | None] = {}
        self._local: dict[str, ClassDefinition] | None = None
        self.record: Binding | None = given.binding if given and path is not None else None

    # -- names and places

    @property
    def qualified(self) -> str:
        """The class name with those of the classes around it."""
        name = self.definition.name
        return f"{self.parent.qualified}.{name}" if self.parent else name

    def place(self, line: int) -> str:
        """``file:line`` of something in this class."""
        return f"{self.definition.file}:{line}"

    def __repr__(self) -> str:
        return f"<{self.qualified} {self.path or ''}>"

    # -- elements

    @property
    def elements(self) -> dict[str, Element]:
        """Declarations by name, inherited ones in the place of their extends clause."""
        if self._elements is None:
            self._elements = {}
            self._build(self._elements)
        return self._elements

    def _build(self, found: dict[str, Element]) -> None:
        definition = self.definition
        redeclared: dict[str, Modifier] = {}
        for element in definition.elements:
            if isinstance(element, (Component, ClassDefinition)) and (
                "redeclare" in element.prefixes
                or (isinstance(element, ClassDefinition) and element.extending)
            ):
                redeclared[element.name] = Modifier(redeclare=(element, self))
        outer = merge(self.given, Modifier(children=redeclared)) if redeclared else self.given
        if self.original is not None:
            self._inherit_scope(
                *self.original, merge(outer, modifier(definition.arguments, None, self)), found
            )
        if definition.base is not None:
            self._inherit(definition.base, definition.arguments, outer, definition.line, found)
            return
        for element in definition.elements:
            if isinstance(element, Extends):
                self._inherit(element.type, element.arguments, outer, element.line, found)
        own: set[str] = set()
        for element in definition.elements:
            if isinstance(element, (Extends, Import)):
                continue
            if element.name in own:
                raise ModelicaError(f"{self.place(element.line)}: {element.name} is declared twice.")
            own.add(element.name)
            if element.name in redeclared and element.name in found:
                continue
            if element.name in found and isinstance(element, Component):
                continue
            found[element.name] = Element(
                element, self, self.given.child(element.name) if self.given else None
            )

    def _inherit(
        self, base: str, arguments: list[Any], outer: Modifier | None, line: int, found: dict[str, Element]
    ) -> None:
        short = self.definition.base is not None
        around = self.parent if short else self
        given = merge(outer, modifier(arguments, None, around or self))
        if base in BUILTIN_TYPES:
            self.builtin = (base, given)
            return
        if around is None:
            target = self.world.top(base.split(".")[0])
            for part in base.split(".")[1:]:
                target = target.member_class(part) if target else None
        else:
            target = around.find_class(base, inherited=short)
        if target is None or target is self:
            raise self.unknown_class(base, line)
        merged = merge(given, target.given)
        scope = self._inherit_scope(target.definition, target.parent, merged, found, target.original)
        if scope.builtin is None:
            scope.check_modified(modifier(arguments, None, around or self))

    def _inherit_scope(
        self,
        definition: ClassDefinition,
        parent: Scope | None,
        given: Modifier | None,
        found: dict[str, Element],
        original: tuple[ClassDefinition, Scope | None] | None = None,
    ) -> Scope:
        scope = Scope(
            self.world,
            definition,
            parent,
            given,
            path=self.path,
            container=self.container,
            derived=self,
            prefixes=self.prefixes,
            original=original,
        )
        self.bases.append(scope)
        elements = scope.elements
        if scope.builtin is not None:
            self.builtin = scope.builtin
        found.update({name: e for name, e in elements.items() if name not in found})
        return scope

    def check_modified(self, given: Modifier | None) -> None:
        """Raises ModelicaError where a modification names something that the class does not have."""
        for name, child in (given.children if given else {}).items():
            if name in self.elements or self.world.library.nested(self.definition, name) is not None:
                continue
            place = f"{child.place}: " if child.place else ""
            raise ModelicaError(
                f"{place}{self.qualified} has no {name} to modify.{did_you_mean(name, list(self.elements))}"
            )

    def unknown_class(self, name: str, line: int) -> ModelicaError:
        """The error for a class that is not found."""
        first = name.split(".")[0] or name.split(".")[1]
        known = self.world.library.names()
        missing = "" if first in known or self.find_class(first) else (
            " Add the folder of its library with --library, or to MODELICAPATH."
        )  # fmt: skip
        hint = "" if missing else did_you_mean(name, [*known, *self.class_names()])
        return ModelicaError(f"{self.place(line)}: the class {name} is not found.{missing}{hint}")

    def class_names(self) -> list[str]:
        """Names of the classes that can be seen from here."""
        own = self.world.library.children(self.definition)
        return own + (self.parent.class_names() if self.parent else [])

    # -- lookup of classes

    def find_class(self, name: str, inherited: bool = True) -> Scope | None:
        """A class by a name as it is written in this scope."""
        first, *rest = name.split(".")
        if first == "":
            first, *rest = rest
            found = self.world.top(first)
        else:
            found = self._find_first(first, inherited)
        for part in rest:
            if found is None:
                return None
            found = found.member_class(part)
        return found

    def _find_first(self, name: str, inherited: bool) -> Scope | None:
        scope: Scope | None = self
        while scope is not None:
            found = scope.member_class(name, inherited) or scope.imported(name)
            if found is not None:
                return found
            inherited = True
            if "encapsulated" in scope.definition.prefixes:
                break
            scope = scope.parent
        return self.world.top(name)

    def imported(self, name: str) -> Scope | None:
        """A class that an import clause of this class makes visible."""
        for element in self.definition.elements:
            if not isinstance(element, Import):
                continue
            if name in element.names:
                return self._absolute(element.names[name])
            for package in element.wildcards:
                scope = self._absolute(package)
                found = scope.member_class(name) if scope else None
                if found is not None:
                    return found
        return None

    def _absolute(self, name: str) -> Scope | None:
        first, *rest = name.split(".")
        found = self.world.top(first)
        if found is None:  # a package of the same file
            found = self.parent._find_first(first, True) if self.parent else None
        for part in rest:
            found = found.member_class(part) if found else None
        return found

    def member_class(self, name: str, inherited: bool = True) -> Scope | None:
        """A class that is declared in this one, or inherited by it."""
        key = name if inherited else f"{name} (own)"
        if key not in self._classes:
            self._classes[key] = self._member_class(name, inherited)
        return self._classes[key]

    def _member_class(self, name: str, inherited: bool) -> Scope | None:
        own = self.world.library.nested(self.definition, name)
        if own is not None and not inherited and "redeclare" not in own.prefixes:
            given = self.given.child(name) if self.given else None
            return self._class_scope(Element(own, self, given))
        if not inherited:
            return None
        element = self.elements.get(name)
        if element is not None:
            return self._class_scope(element) if isinstance(element.declaration, ClassDefinition) else None
        for base in self.bases:
            found = base.member_class(name)
            if found is not None:
                return found
        if own is not None:
            return self._class_scope(Element(own, self, self.given.child(name) if self.given else None))
        return None

    def _class_scope(self, element: Element) -> Scope:
        declaration, owner, given = element
        assert isinstance(declaration, ClassDefinition)
        if given is not None and given.redeclare is not None:
            replacement, scope = given.redeclare
            if not isinstance(replacement, ClassDefinition):
                raise ModelicaError(
                    f"{scope.place(replacement.line)}: {declaration.name} is a class, not a component."
                )
            rest = Modifier(None, given.children)
            limits = constraint(declaration, owner)
            if replacement.extending:
                original = (declaration, owner)
                return Scope(self.world, replacement, scope, merge(rest, limits), original=original)
            check_replaceable(element, scope, replacement)
            if replacement.name == replacement.base:  # redeclare model A = A: the outer A
                outside = scope.parent or scope
                target = outside.find_class(replacement.base)
                if target is not None:
                    inner = merge(modifier(replacement.arguments, None, scope), target.given)
                    return Scope(self.world, target.definition, target.parent, merge(rest, inner))
            return Scope(self.world, replacement, scope, merge(rest, limits))
        return Scope(self.world, declaration, owner, given)

    # -- components

    def declares(self, name: str) -> bool:
        """Whether a component of this name is declared here or inherited."""
        element = self.elements.get(name)
        return element is not None and isinstance(element.declaration, Component)

    def component(self, name: str) -> Any:
        """A component: a Variable, a Scope, DISABLED, or a list of these for an array."""
        instance = self.instance
        if name not in instance.nodes:
            from thsa_cosim.modelica.instantiate import instantiate

            element = instance.elements[name]
            instance.nodes[name] = None
            try:
                instance.nodes[name] = instantiate(instance, name, element)
            except BaseException:
                del instance.nodes[name]
                raise
        node = instance.nodes[name]
        if node is None:
            raise ModelicaError(
                f"{instance.place(instance.definition.line)}: {name} is declared in terms of itself."
            )
        return node

    def type_of(self, base: str, line: int) -> Scope:
        """The class of a component's type; raises ModelicaError if there is none."""
        found = self.find_class(base)
        if found is None:
            raise self.unknown_class(base, line)
        return found
