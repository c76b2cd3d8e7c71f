"""Where functions leave their domain: sqrt of a negative, log of what is not positive, asin beyond 1.

The C library answers with NaN, and nobody sees one in a variable that is not read. So every such call that is
evaluated, its branch being taken, becomes an assertion that ends the run (Modelica Language Specification 3.6, 3.7.3).
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import casadi as ca

from thsa_cosim.export.graph import Graph

if TYPE_CHECKING:
    from thsa_cosim.export.model import CausalModel

_ROUNDING = 1e-12  # a relation that guards a branch lets rounding noise of this size through
_LONGEST = 80

_NONNEGATIVE = frozenset((ca.OP_SQ, ca.OP_FABS, ca.OP_SQRT, ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT,
                          ca.OP_AND, ca.OP_OR, ca.OP_HYPOT))  # fmt: skip
_POWERS = frozenset((ca.OP_POW, ca.OP_CONSTPOW))


def _below(a: ca.SX, *_: ca.SX) -> ca.SX:
    return a < -_ROUNDING


def _not_above(a: ca.SX, *_: ca.SX) -> ca.SX:
    return ca.logic_or(a == 0, a < -_ROUNDING)


def _outside(a: ca.SX, *_: ca.SX) -> ca.SX:
    return ca.fabs(a) > 1 + _ROUNDING


def _broken(base: ca.SX, exponent: ca.SX) -> ca.SX:
    return ca.logic_and(base < -_ROUNDING, ca.floor(exponent) != exponent)


_DOMAINS: dict[int, tuple[str, str, Callable[..., ca.SX]]] = {
    ca.OP_SQRT: ("sqrt", "a negative number", _below),
    ca.OP_LOG: ("log", "a number that is not positive", _not_above),
    ca.OP_ASIN: ("asin", "a number beyond 1", _outside),
    ca.OP_ACOS: ("acos", "a number beyond 1", _outside),
    ca.OP_POW: ("power", "a negative number with a broken exponent", _broken),
    ca.OP_CONSTPOW: ("power", "a negative number with a broken exponent", _broken),
}


def with_domains(model: CausalModel) -> CausalModel:
    """The model with a condition, and a text, for every function that can leave its domain."""
    graph = Graph()
    targets = [*graph.add_column(model.rhs), *graph.add_column(model.w)]
    calls = [n for n in graph.needed(targets) if graph.nodes[n].op in _DOMAINS and not _safe(graph, n)]
    if not calls:
        return model
    expressions = graph.expressions()
    used = _used(graph, targets, expressions)
    violated, texts = [], []
    for call in calls:
        name, fault, condition = _DOMAINS[graph.nodes[call].op or 0]
        arguments = [expressions[a] for a in graph.nodes[call].arguments]
        condition_here, when = condition(*arguments), used[call]
        if when is not None:
            condition_here = ca.logic_and(when, condition_here)
        shown = str(arguments[0])
        of = f"{name} of {shown}" if len(shown) <= _LONGEST and "@" not in shown else name
        violated.append(condition_here)
        texts.append(f"{of} in {_owner(model, graph, targets, call)}: it is {fault}")
    # Relations as they are here: one that is about to change has not protected its branch.
    fresh = ca.substitute([ca.vertcat(*violated)], [model.m[: model.g.numel()]], [model.g > 0])[0]
    return replace(model, domain=fresh, domain_texts=tuple(texts))


def continued(call: Callable[[ca.SX], ca.SX], argument: ca.SX) -> ca.SX:
    """A root with 0 for a negative argument.

    Between events a branch is used a little beyond its border (``if x > 0 then sqrt(x) else 0``), where there has to be
    a number; what is negative when a step ends is found by the conditions of `with_domains`.
    """
    graph = Graph()
    if argument.is_constant() or _sign(graph, graph.add(argument)):
        return call(argument)
    return ca.if_else(argument <= 0, 0, call(argument))


def _used(graph: Graph, targets: list[int], expressions: dict[int, ca.SX]) -> dict[int, ca.SX | None]:
    """For every node the condition under which a branch that is taken needs it; None for always."""
    order = graph.needed(targets)
    users = graph.users(order)
    found: dict[int, ca.SX | None] = dict.fromkeys(targets)
    for node in reversed(order):
        if node in found:
            continue
        ways = []
        for user in users[node]:
            way, entry = found[user], graph.nodes[user]
            condition = entry.arguments[0]
            if (
                entry.op == ca.OP_IF_ELSE_ZERO
                and condition != node
                and not _continues(graph, condition, node)
            ):
                holds = expressions[condition] != 0
                way = holds if way is None else ca.logic_and(way, holds)
            ways.append(way)
        sometimes = [way for way in ways if way is not None]
        found[node] = functools.reduce(ca.logic_or, sometimes) if len(sometimes) == len(ways) else None
    return found


def _continues(graph: Graph, condition: int, call: int) -> bool:
    """Whether a condition is the one of `continued`, which relations of a model never look like."""
    node = graph.nodes[condition]
    if node.op != ca.OP_NOT or graph.nodes[call].op not in _DOMAINS:
        return False
    argument = graph.nodes[call].arguments[0]
    inner = graph.nodes[node.arguments[0]]
    return (
        inner.op == ca.OP_LE
        and inner.arguments[0] == argument
        and graph.nodes[inner.arguments[1]].constant == 0
    )


def _owner(model: CausalModel, graph: Graph, targets: list[int], call: int) -> str:
    """The first variable, by what is evaluated, that needs the call."""
    index = next(i for i, target in enumerate(targets) if call in graph.needed([target]))
    n = model.rhs.numel()
    kind, index = ("derivative", index) if index < n else ("algebraic", index - n)
    return next(v.name for v in model.variables if v.kind == kind and v.index == index)


def _safe(graph: Graph, call: int) -> bool:
    """Whether the signs of what an argument is made of keep it in the domain."""
    node = graph.nodes[call]
    least = 1 if node.op in (ca.OP_SQRT, *_POWERS) else 2 if node.op == ca.OP_LOG else 3
    if node.op in _POWERS:
        exponent = graph.nodes[node.arguments[1]].constant
        if exponent is not None and exponent == int(exponent):
            return True
    return _sign(graph, node.arguments[0]) >= least


def _sign(graph: Graph, index: int) -> int:
    """2: positive, 1: not negative, 0: not known."""
    known: dict[int, int] = {}
    for n in graph.needed([index]):  # arguments come first
        node = graph.nodes[n]
        below = [known[a] for a in node.arguments]
        found = 0
        if node.constant is not None:
            found = 2 if node.constant > 0 else 1 if node.constant == 0 else 0
        elif node.op == ca.OP_EXP:
            found = 2
        elif node.op in (ca.OP_ADD, ca.OP_FMAX):
            found = max(below) if min(below) or node.op == ca.OP_FMAX else 0
        elif node.op in (ca.OP_MUL, ca.OP_DIV, ca.OP_FMIN):
            same = node.arguments[0] == node.arguments[1]
            found = max(1, min(below)) if same and node.op == ca.OP_MUL else min(below)
        elif node.op in (ca.OP_TWICE, ca.OP_INV, ca.OP_SQRT):
            found = max(below[0], int(node.op == ca.OP_SQRT))
        elif node.op in _POWERS:
            found = below[0]
        elif node.op == ca.OP_IF_ELSE_ZERO:
            found = min(1, below[1])
        elif node.op in _NONNEGATIVE:
            found = 1
        known[n] = found
    return known[index]
