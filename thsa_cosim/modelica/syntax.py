"""The syntax tree of Modelica source (Modelica Language Specification 3.6, appendix A).

Expressions are instances of ``Syntax``; class definitions, components and modifications have classes of their own.
Annotations are skipped, except ``experiment``.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple


class Syntax(NamedTuple):
    """One expression: ``op`` says what it is, ``line`` where it stands.

    ==================  ===========================================================
    op                  args
    ==================  ===========================================================
    number, string      (value,)
    boolean             (value,)
    name                ((identifier, subscripts), …), a leading dot as ``("", ())``
    unary               (operator, operand)
    binary              (operator, left, right)
    if                  (((condition, value), …), otherwise)
    call                (name, arguments, {name: argument})
    array, tuple        items
    comprehension       (item, iterators)
    matrix              rows, each a tuple of expressions
    range               (first, step or None, last)
    end, colon          ()
    function            (name, arguments)
    ==================  ===========================================================
    """

    op: str
    args: Any
    line: int = 0


@dataclass(slots=True, eq=False)
class Argument:
    """One argument of a modification: ``path(nested) = value`` or a redeclaration."""

    name: str
    nested: "list[Argument]"
    value: Syntax | None
    each: bool
    final: bool
    redeclare: "Component | ClassDefinition | None"
    line: int


@dataclass(slots=True, eq=False)
class Component:
    """A component declaration; ``prefixes`` holds the words before the type."""

    name: str
    type: str
    prefixes: frozenset[str]
    dimensions: tuple[Syntax, ...]
    arguments: list[Argument]
    value: Syntax | None
    condition: Syntax | None
    description: str
    constraint: "tuple[str, list[Argument]] | None"
    protected: bool
    line: int


@dataclass(slots=True, eq=False)
class Extends:
    """An extends clause."""

    type: str
    arguments: list[Argument]
    line: int


@dataclass(slots=True, eq=False)
class Import:
    """An import clause: ``names`` maps local names to qualified ones; ``wildcards`` are packages."""

    names: dict[str, str]
    wildcards: list[str]


class Equation(NamedTuple):
    """One equation or statement.

    ==================  ===========================================================
    op                  args
    ==================  ===========================================================
    equal, assign       (left, right)
    connect             (left, right)
    call                (call,)
    if, when            (((condition, equations), …), otherwise)
    for                 (((name, range or None), …), equations)
    while               (condition, equations)
    return, break       ()
    ==================  ===========================================================
    """

    op: str
    args: Any
    line: int


@dataclass(slots=True, eq=False)
class ClassDefinition:
    """A class; a short definition ``A = B[n](…)`` has ``base``, an enumeration has ``literals``."""

    name: str
    kind: str
    file: Path
    line: int
    prefixes: frozenset[str] = frozenset()
    description: str = ""
    protected: bool = False
    elements: "list[Component | Extends | Import | ClassDefinition]" = field(default_factory=list)
    equations: list[Equation] = field(default_factory=list)
    initial_equations: list[Equation] = field(default_factory=list)
    algorithms: list[list[Equation]] = field(default_factory=list)
    initial_algorithms: list[list[Equation]] = field(default_factory=list)
    base: str | None = None
    arguments: list[Argument] = field(default_factory=list)
    dimensions: tuple[Syntax, ...] = ()
    literals: tuple[str, ...] | None = None
    constraint: "tuple[str, list[Argument]] | None" = None
    external: tuple[str, str] | None = None  # language, function
    extending: bool = False
    experiment: dict[str, float] = field(default_factory=dict)
