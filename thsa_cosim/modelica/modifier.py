"""Modifications as trees, merged from the outside in (Modelica Language Specification 3.6, 7.2)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from thsa_cosim.modelica.syntax import Argument, ClassDefinition, Component, Syntax

if TYPE_CHECKING:
    from thsa_cosim.modelica.scope import Scope


class Binding(NamedTuple):
    """A value with the scope that its names belong to, and the subscripts of the array element that it is for."""

    value: Syntax
    scope: Scope
    indices: tuple[int, ...] = ()
    final: bool = False
    sizes: tuple[int, ...] = ()  # of the arrays that the indices are for, where they are known


class Modifier:
    """What is said about one element: its value, its own elements, its replacement."""

    __slots__ = ("binding", "children", "each", "final", "place", "redeclare")

    def __init__(
        self,
        binding: Binding | None = None,
        children: dict[str, Modifier] | None = None,
        redeclare: tuple[Component | ClassDefinition, Scope] | None = None,
        each: bool = False,
        final: bool = False,
    ) -> None:
        self.binding = binding
        self.children = children or {}
        self.redeclare = redeclare
        self.each = each
        self.final = final
        self.place = ""

    def child(self, name: str) -> Modifier | None:
        """What is said about an element by its name."""
        return self.children.get(name)


def modifier(
    arguments: list[Argument], value: Syntax | None, scope: Scope, final: bool = False
) -> Modifier | None:
    """The modification ``(arguments) = value`` as it stands in a scope; None when it says nothing."""
    if not arguments and value is None:
        return None
    made = Modifier(Binding(value, scope, final=final) if value is not None else None, final=final)
    for argument in arguments:
        nested = modifier(argument.nested, argument.value, scope, argument.final) or Modifier()
        nested.each, nested.final = argument.each, argument.final
        nested.place = scope.place(argument.line)
        if argument.redeclare is not None:
            nested.redeclare = (argument.redeclare, scope)
        earlier = made.children.get(argument.name)
        merged = merge(nested, earlier)
        assert merged is not None
        made.children[argument.name] = merged
    return made


def merge(outer: Modifier | None, inner: Modifier | None) -> Modifier | None:
    """The two together; the outer one wins."""
    if outer is None or inner is None:
        return outer or inner
    if outer is inner:
        return outer
    children = dict(inner.children)
    for name, child in outer.children.items():
        merged = merge(child, children.get(name))
        assert merged is not None
        children[name] = merged
    made = Modifier(
        outer.binding or inner.binding,
        children,
        outer.redeclare or inner.redeclare,
        outer.each if outer.binding or outer.children else inner.each,
        outer.final or inner.final,
    )
    made.place = outer.place or inner.place
    return made


def element_of(given: Modifier | None, index: int, size: int) -> Modifier | None:
    """The part of an array's modification that is for one of ``size`` elements, by its subscript from 1."""
    if given is None or given.each:
        return given
    binding = given.binding
    if binding is not None:
        binding = binding._replace(indices=(*binding.indices, index), sizes=(*binding.sizes, size))
    children = {}
    for name, child in given.children.items():
        part = element_of(child, index, size)
        assert part is not None
        children[name] = part
    made = Modifier(binding, children, given.redeclare, given.each, given.final)
    made.place = given.place
    return made


def spread(given: Modifier | None) -> Modifier | None:
    """The modification of one element of an array: what stood behind ``each`` is now its own."""
    if given is None or not any(child.each for child in given.children.values()):
        return given
    children = {}
    for name, child in given.children.items():
        children[name] = Modifier(child.binding, child.children, child.redeclare, False, child.final)
        children[name].place = child.place
    made = Modifier(given.binding, children, given.redeclare, given.each, given.final)
    made.place = given.place
    return made
