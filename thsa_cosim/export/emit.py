"""Graph → C: one statement a node, costly branches inside ``if``, slow subexpressions from a cache."""

from collections.abc import Sequence
from math import isinf, isnan

import casadi as ca

from thsa_cosim.export.graph import Graph, Node, Place

_BINARY = {ca.OP_ADD: "{} + {}", ca.OP_SUB: "{} - {}", ca.OP_MUL: "{} * {}", ca.OP_DIV: "{} / {}"}
_TEXT = {
    **_BINARY,
    ca.OP_NEG: "-{}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "2.0 * {}",
    ca.OP_INV: "1.0 / {}",
    ca.OP_LT: "(double)({} < {})",
    ca.OP_LE: "(double)({} <= {})",
    ca.OP_EQ: "(double)({} == {})",
    ca.OP_NE: "(double)({} != {})",
    ca.OP_NOT: "(double)({} == 0.0)",
    ca.OP_AND: "(double)({} != 0.0 && {} != 0.0)",
    ca.OP_OR: "(double)({} != 0.0 || {} != 0.0)",
    ca.OP_IF_ELSE_ZERO: "{} != 0.0 ? {} : 0.0",
    ca.OP_SIGN: "(double)(({0} > 0.0) - ({0} < 0.0))",
    ca.OP_ASSIGN: "{}",
}
_CALLS = {
    ca.OP_EXP: "exp", ca.OP_LOG: "log", ca.OP_POW: "pow", ca.OP_CONSTPOW: "pow", ca.OP_SQRT: "sqrt", ca.OP_SIN: "sin",
    ca.OP_COS: "cos", ca.OP_TAN: "tan", ca.OP_ASIN: "asin", ca.OP_ACOS: "acos", ca.OP_ATAN: "atan", ca.OP_SINH: "sinh",
    ca.OP_COSH: "cosh", ca.OP_TANH: "tanh", ca.OP_ATAN2: "atan2", ca.OP_FABS: "fabs", ca.OP_FMIN: "fmin",
    ca.OP_FMAX: "fmax", ca.OP_FLOOR: "floor", ca.OP_CEIL: "ceil", ca.OP_FMOD: "fmod", ca.OP_COPYSIGN: "copysign",
    ca.OP_EXPM1: "expm1", ca.OP_LOG1P: "log1p", ca.OP_HYPOT: "hypot", ca.OP_ERF: "erf",
}  # fmt: skip


def number(value: float) -> str:
    """A double as C literal that reads back to the same bits."""
    if isnan(value):
        return "NAN"
    if isinf(value):
        return "INFINITY" if value > 0 else "(-INFINITY)"
    return repr(float(value)) if value >= 0 else f"({float(value)!r})"


def statements(
    graph: Graph, outputs: Sequence[tuple[str, int]], symbols: dict[str, str], cached: dict[int, str]
) -> list[str]:
    """C statements that assign every output.

    ``outputs`` are pairs of an lvalue and a node, ``symbols`` the C text of the symbols, ``cached`` that of nodes whose
    value is there already.
    """
    writer = _Writer(graph, [node for _, node in outputs], symbols, cached)
    lines = writer.write((), writer.order, "  ")
    return [*lines, *[f"  {target} = {writer.text(node)};" for target, node in outputs]]


class _Writer:
    """Writes the nodes of one function; remembers which are written and which were declared ahead."""

    def __init__(
        self, graph: Graph, targets: list[int], symbols: dict[str, str], cached: dict[int, str]
    ) -> None:
        self.graph = graph
        self.symbols = symbols
        self.cached = cached
        self.order = graph.needed(targets, cached)
        self.guard = graph.guards(targets, list(cached))
        self.users = graph.users(self.order, cached)
        self.guarded = {place[: depth + 1] for place in self.guard.values() for depth in range(len(place))}
        self.written: set[int] = set()
        self.declared: set[int] = set()
        self.choices = self._choices(targets)
        # the branches of choices, and the negations that only they use, are part of the choices' text
        self.absorbed = {branch for choice in self.choices for branch in graph.nodes[choice].arguments}
        conditions = {graph.nodes[branch].arguments[0] for branch in self.absorbed}
        read = {node for choice in self.choices.values() for node in choice}.union(targets)
        self.absorbed |= {c for c in conditions - read if self.absorbed.issuperset(self.users[c])}

    def _choices(self, targets: list[int]) -> dict[int, tuple[int, int, int]]:
        """Sums ``(c ? a : 0) + (not c ? b : 0)`` that can be written as ``c ? a : b``: (c, a, b) of each."""
        found = {}
        for node in self.order:
            branches = self.graph.nodes[node].arguments
            if self.graph.nodes[node].op != ca.OP_ADD or node in self.cached:
                continue
            if all(self._serves_alone(branch, node, targets) for branch in branches):
                (c, a), (opposite, b) = (self.graph.nodes[branch].arguments for branch in branches)
                if self.graph.nodes[c] == Node(ca.OP_NOT, (opposite,)):
                    found[node] = (opposite, b, a)
                elif self.graph.nodes[opposite] == Node(ca.OP_NOT, (c,)):
                    found[node] = (c, a, b)
        return found

    def _serves_alone(self, branch: int, total: int, targets: list[int]) -> bool:
        """Whether ``branch`` is a ``c ? a : 0`` without a block of its own, which only ``total`` uses."""
        entry = self.graph.nodes[branch]
        return (
            entry.op == ca.OP_IF_ELSE_ZERO
            and branch not in self.cached
            and branch not in targets
            and set(self.users[branch]) == {total}
            and (*self.guard[branch], entry.arguments[0]) not in self.guarded
        )

    def text(self, node: int) -> str:
        """C text of a node's value."""
        entry = self.graph.nodes[node]
        if node in self.cached:
            return self.cached[node]
        if entry.constant is not None:
            return number(entry.constant)
        if entry.symbol is not None:
            return self.symbols[entry.symbol]
        return f"a{node}"

    def write(self, place: Place, nodes: list[int], indent: str) -> list[str]:
        """Statements for those of ``nodes`` that are guarded by ``place``, with the blocks that they need."""
        lines: list[str] = []
        for node in nodes:
            entry = self.graph.nodes[node]
            if self.guard[node] != place or node in self.written or entry.op is None:
                continue
            if node in self.cached or node in self.absorbed:
                continue
            self.written.add(node)
            arguments = [self.text(argument) for argument in entry.arguments]
            inner = (*place, entry.arguments[0])
            if entry.op == ca.OP_IF_ELSE_ZERO and inner in self.guarded:
                lines += self._block(node, inner, arguments, indent)
            elif node in self.choices:
                condition, yes, no = (self.text(argument) for argument in self.choices[node])
                lines.append(f"{indent}{self._target(node)} = {condition} != 0.0 ? {yes} : {no};")
            else:
                call = _CALLS.get(entry.op)
                value = f"{call}({', '.join(arguments)})" if call else _TEXT[entry.op].format(*arguments)
                lines.append(f"{indent}{self._target(node)} = {value};")
        return lines

    def _target(self, node: int) -> str:
        return f"a{node}" if node in self.declared else f"const double a{node}"

    def _block(self, node: int, inner: Place, arguments: list[str], indent: str) -> list[str]:
        """``if (condition) { … }`` for one conditional; what other blocks use too is declared ahead."""
        below = self.graph.needed([self.graph.nodes[node].arguments[1]], self.cached)
        batch = [n for n in below if self.guard[n][: len(inner)] == inner and n not in self.written]
        ahead = [] if node in self.declared else [node]
        inside = {*batch, node}
        for member in batch:
            entry = self.graph.nodes[member]
            if entry.op is None or member in self.cached or member in self.declared | self.absorbed:
                continue
            if not inside.issuperset(self.users[member]):
                ahead.append(member)
        self.declared.update(ahead)
        lines = [f"{indent}double a{member} = 0.0;" for member in ahead]
        lines.append(f"{indent}if ({arguments[0]} != 0.0) {{")
        lines += self.write(inner, batch, indent + "  ")
        lines += [f"{indent}  a{node} = {arguments[1]};", f"{indent}}}"]
        return lines
