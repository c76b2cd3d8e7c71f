"""What replaces a declaration, and whether it may (Modelica Language Specification 3.6, 7.3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica.modifier import Binding, Modifier, merge, modifier
from thsa_cosim.modelica.syntax import ClassDefinition, Component

if TYPE_CHECKING:
    from thsa_cosim.modelica.scope import Element, Scope

_TYPE_PREFIXES = frozenset(
    ["flow", "stream", "discrete", "parameter", "constant", "input", "output", "inner", "outer"]
)


def constraint(declaration: Component | ClassDefinition, owner: Scope) -> Modifier | None:
    """What a replaceable element says about everything that replaces it."""
    if declaration.constraint is not None:
        return modifier(declaration.constraint[1], None, owner)
    if isinstance(declaration, Component) or declaration.base is not None:
        return modifier(declaration.arguments, None, owner)
    return None


def check_replaceable(element: Element, scope: Scope, replacement: Component | ClassDefinition) -> None:
    """Raises ModelicaError where what is redeclared is not replaceable, or the class does not fit the constraint."""
    declaration, owner, _ = element
    place = scope.place(replacement.line)
    if not declaration.prefixes & {"replaceable", "redeclare"}:
        raise ModelicaError(f"{place}: {declaration.name} is redeclared, but is not declared replaceable.")
    if not (isinstance(declaration, Component) and isinstance(replacement, Component)):
        return
    wanted = owner.find_class(declaration.constraint[0] if declaration.constraint else declaration.type)
    given = scope.find_class(replacement.type)
    if wanted is None or given is None or wanted.definition is given.definition:
        return
    missing = [
        name
        for name, (part, *_) in wanted.elements.items()
        if isinstance(part, Component) and not part.protected and name not in given.elements
    ]
    if missing:
        raise ModelicaError(
            f"{place}: {given.qualified} cannot replace {declaration.name}: it has no {missing[0]}, unlike "
            f"{wanted.qualified}."
        )


def resolved(element: Element) -> tuple[Component, Scope, Modifier | None]:
    """Declaration, scope and modification of a component after redeclaration."""
    declaration, owner, given = element
    assert isinstance(declaration, Component)
    if given is None or given.redeclare is None:
        return declaration, owner, merge(given, modifier(declaration.arguments, declaration.value, owner))
    replacement, scope = given.redeclare
    if not isinstance(replacement, Component):
        raise ModelicaError(
            f"{scope.place(replacement.line)}: {declaration.name} is a component, not a class."
        )
    check_replaceable(element, scope, replacement)
    outer = Modifier(given.binding, given.children, None, given.each, given.final)
    own = modifier(replacement.arguments, replacement.value, scope)
    merged = merge(merge(outer, own), constraint(declaration, owner))
    if merged is not None and merged.binding is None and declaration.value is not None:
        merged = merge(merged, Modifier(Binding(declaration.value, owner)))
    elif merged is None and declaration.value is not None:
        merged = Modifier(Binding(declaration.value, owner))
    combined = Component(
        declaration.name,
        replacement.type,
        (declaration.prefixes & _TYPE_PREFIXES) | replacement.prefixes,
        replacement.dimensions or declaration.dimensions,
        [],
        None,
        declaration.condition,
        replacement.description or declaration.description,
        None,
        declaration.protected,
        replacement.line,
    )
    return combined, scope, merged
