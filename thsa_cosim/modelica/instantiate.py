"""A declaration → its component: a variable, an instance of a class, or an array of these."""

from __future__ import annotations

import re
from typing import Any

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica.arrays import shape
from thsa_cosim.modelica.evaluate import Evaluator, bound
from thsa_cosim.modelica.modifier import Binding, Modifier, element_of, merge, spread
from thsa_cosim.modelica.redeclaration import resolved
from thsa_cosim.modelica.scope import BUILTIN_TYPES, DISABLED, Element, Scope, Variable
from thsa_cosim.modelica.syntax import Component, Syntax

ATTRIBUTES = frozenset(
    re.findall(
        r"\w+",
        """
    start fixed unit displayUnit quantity min max nominal stateSelect unbounded uncertain
        """,
    )
)
_INHERITED = frozenset(["flow", "stream", "discrete", "parameter", "constant", "input", "output"])
_MOST_ELEMENTS = 100_000
_MOST_LEVELS = 60


def instantiate(instance: Scope, name: str, element: Element) -> Any:
    """The component ``name`` of an instance: a Variable, a Scope, DISABLED, or nested lists of these."""
    declaration, owner, given = resolved(element)
    if isinstance(element.declaration, Component) and element.modifier is not None:
        _refuse_final(element, instance)
    if declaration.condition is not None:
        chosen = Evaluator(_here(owner, instance)).structural(
            declaration.condition, f"the condition of {name}"
        )
        if not chosen:
            return DISABLED
    if "outer" in declaration.prefixes and "inner" not in declaration.prefixes:
        return _inner(instance, name, declaration)
    here = _here(owner, instance)
    target: Scope | None = None
    if declaration.type not in BUILTIN_TYPES:
        target = here.type_of(declaration.type, declaration.line)
        _ = target.elements
    prefixes = (declaration.prefixes & _INHERITED) | (instance.prefixes & _INHERITED)
    if target is not None:
        prefixes |= target.definition.prefixes & frozenset(("input", "output", "flow", "stream"))
    path = f"{instance.path}.{name}" if instance.path else name
    if instance.path is None:
        path = f"{instance.qualified}.{name}"
    maker = _Maker(instance, declaration, here, target, prefixes)
    sizes = maker.sizes(given, path)
    return maker.array(path, given, sizes)


def _here(owner: Scope, instance: Scope) -> Scope:
    return owner


def _refuse_final(element: Element, instance: Scope) -> None:
    """A modification of what was declared final is an error of the model."""
    declaration = element.declaration
    if (
        "final" in declaration.prefixes
        and element.modifier is not None
        and element.modifier.binding is not None
    ):
        line = element.modifier.binding.value.line
        place = element.modifier.binding.scope.place(line)
        raise ModelicaError(f"{place}: {declaration.name} is final and cannot be modified.")


def _inner(instance: Scope, name: str, declaration: Component) -> Any:
    scope = instance.container
    while scope is not None:
        element = scope.elements.get(name)
        if element is not None and isinstance(element.declaration, Component):
            found = resolved(element)[0]
            if "inner" in found.prefixes:
                return scope.component(name)
        scope = scope.container
    raise ModelicaError(
        f"{instance.place(declaration.line)}: {instance.path}.{name} is outer, but no inner {name} is declared "
        "around it."
    )


class _Maker:
    """Makes the elements of one declaration."""

    def __init__(
        self,
        instance: Scope,
        declaration: Component,
        owner: Scope,
        target: Scope | None,
        prefixes: frozenset[str],
    ) -> None:
        self.instance = instance
        self.declaration = declaration
        self.owner = owner
        self.target = target
        self.prefixes = prefixes

    def sizes(self, given: Modifier | None, path: str) -> list[int]:
        """Sizes of the dimensions: of the component, then those of its type."""
        found: list[int] = []
        evaluator = Evaluator(self.owner)
        for place, dimension in enumerate(self.declaration.dimensions):
            if dimension.op == "colon":
                found.append(self._inferred(given, place, path))
            else:
                found.append(self._size(evaluator, dimension, path))
        scope = self.target
        while scope is not None:
            inner = Evaluator(scope.parent or scope)
            found += [self._size(inner, d, path) for d in scope.definition.dimensions]
            scope = scope.bases[0] if scope.definition.base is not None and scope.bases else None
        return found

    def _size(self, evaluator: Evaluator, dimension: Syntax, path: str) -> int:
        literals = None
        if dimension.op == "name":
            named = evaluator.scope.find_class(".".join(p for p, _ in dimension.args))
            if named is not None:
                _ = named.elements
                literals = named.definition.literals
                if literals is None and named.definition.base == "Boolean":
                    literals = ("false", "true")
            elif dimension.args == (("Boolean", ()),):
                literals = ("false", "true")
        if literals is not None:
            return len(literals)
        size = evaluator.structural(dimension, f"the size of {path}")
        if not isinstance(size, (int, float)) or size < 0 or size != int(size):
            raise ModelicaError(
                f"{evaluator.scope.place(dimension.line)}: the size of {path} is {size}, not a whole number."
            )
        return int(size)

    def _inferred(self, given: Modifier | None, place: int, path: str) -> int:
        binding = given.binding if given else None
        if binding is None and given is not None and given.child("start") is not None:
            binding = given.children["start"].binding
        if binding is None and self.instance.record is not None:
            outer = self.instance.record
            member = Syntax("member", (outer.value, self.declaration.name), outer.value.line)
            binding = Binding(member, outer.scope, outer.indices)
        if binding is None:
            raise ModelicaError(
                f"{self.owner.place(self.declaration.line)}: the size of {path} is ':', but there is no value to take "
                "it from."
            )
        sizes = shape(bound(binding))
        if place < len(sizes):
            return sizes[place]
        if 0 in sizes:
            return 0
        raise ModelicaError(
            f"{self.owner.place(self.declaration.line)}: the value of {path} has {len(sizes)} dimensions, too few."
        )

    def array(
        self, path: str, given: Modifier | None, sizes: list[int], indices: tuple[int, ...] = ()
    ) -> Any:
        """Nested lists over the sizes."""
        if not sizes:
            label = f"{path}[{','.join(str(i) for i in indices)}]" if indices else path
            return self.element(label, given)
        if sizes[0] > _MOST_ELEMENTS:
            raise ModelicaError(f"{self.owner.place(self.declaration.line)}: {path} has {sizes[0]} elements.")
        return [
            self.array(path, element_of(given, k, sizes[0]), sizes[1:], (*indices, k))
            for k in range(1, sizes[0] + 1)
        ]

    def element(self, path: str, given: Modifier | None) -> Any:
        given = self._with_record(path, given)
        target = self.target
        if (
            target is None
            or target.builtin is not None
            or target.definition.literals is not None
            or _enumeration(target)
        ):
            return self._variable(path, given)
        incomplete = "partial" in target.definition.prefixes and target.definition.kind != "connector"
        if incomplete and self.instance.path is not None:
            raise ModelicaError(
                f"{self.owner.place(self.declaration.line)}: the class {target.qualified} of {path} is partial: it "
                "has to be redeclared."
            )
        if path.count(".") > _MOST_LEVELS:
            raise ModelicaError(
                f"{self.owner.place(self.declaration.line)}: {target.qualified} contains itself without end."
            )
        made = Scope(
            self.instance.world,
            target.definition,
            target.parent,
            merge(spread(given), target.given),
            path=path,
            container=self.instance,
            prefixes=self.prefixes - {"protected"},
            original=target.original,
        )
        made.check_modified(made.given)
        return made

    def _with_record(self, path: str, given: Modifier | None) -> Modifier | None:
        """A field takes its value from the value of the record that it belongs to."""
        record = self.instance.record
        if record is None or "constant" in self.prefixes:
            return given
        own = self.instance.given.child(self.declaration.name) if self.instance.given else None
        if own is not None and own.binding is not None:
            return given
        member = Syntax("member", (record.value, self.declaration.name), record.value.line)
        subscripts = path[len(f"{self.instance.path}.{self.declaration.name}") :]
        indices = tuple(int(i) for i in subscripts[1:-1].split(",")) if subscripts else ()
        binding = Binding(member, record.scope, (*record.indices, *indices), record.final)
        return merge(Modifier(binding), given)

    def _variable(self, path: str, given: Modifier | None) -> Variable:
        declaration, world = self.declaration, self.instance.world
        kind = declaration.type
        literals: tuple[str, ...] = ()
        merged = given
        if self.target is not None:
            enumeration = _enumeration(self.target)
            if enumeration is not None:
                kind, literals = "enumeration", enumeration.definition.literals or ()
                merged = merge(given, self.target.given)
            else:
                assert self.target.builtin is not None
                kind, attributes = self.target.builtin
                merged = merge(given, attributes)
        variability = "continuous"
        if "constant" in self.prefixes:
            variability = "constant"
        elif "parameter" in self.prefixes:
            variability = "parameter"
        elif "discrete" in self.prefixes or kind not in ("Real", "ExternalObject"):
            variability = "discrete"
        found: dict[str, Binding] = {}
        for name, child in (merged.children if merged else {}).items():
            if name not in ATTRIBUTES:
                place = child.binding.scope.place(child.binding.value.line) if child.binding else path
                raise ModelicaError(f"{place}: {path} is a {kind}, which has no attribute {name}.")
            if child.binding is not None:
                found[name] = child.binding
        final = "final" in declaration.prefixes or bool(given and given.binding and given.binding.final)
        variable = Variable(
            path,
            kind,
            variability,
            self.prefixes
            | (declaration.prefixes & frozenset(("inner",)))
            | (frozenset(("protected",)) if declaration.protected else frozenset()),
            declaration.description,
            given.binding if given else None,
            found,
            final,
            self.owner.place(declaration.line),
            self.instance if self.instance.path is not None else self.owner,
            tuple(literals),
        )
        if self.instance.path is not None:
            world.variables[path] = variable
        return variable


def _enumeration(scope: Scope) -> Scope | None:
    """The enumeration that a type is, or is derived from."""
    if scope.definition.literals is not None:
        return scope
    for base in scope.bases:
        found = _enumeration(base)
        if found is not None:
            return found
    return None
