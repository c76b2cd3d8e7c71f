"""Graph → C: one statement a node, costly branches inside ``if``, slow subexpressions from a cache."""

from collections.abc import Sequence
from math import isinf, isnan

import casadi as ca

from thsa_cosim.export.graph import ROOT, Graph

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
    targets = [node for _, node in outputs]
    guard = graph.guards(targets, list(cached))
    inside: dict[int, list[int]] = {}
    for node in sorted(guard):
        inside.setdefault(guard[node], []).append(node)

    def text(node: int) -> str:
        entry = graph.nodes[node]
        if node in cached:
            return cached[node]
        if entry.constant is not None:
            return number(entry.constant)
        if entry.symbol is not None:
            return symbols[entry.symbol]
        return f"a{node}"

    def write(place: int, indent: str) -> list[str]:
        lines: list[str] = []
        for node in inside.get(place, []):
            entry = graph.nodes[node]
            if entry.op is None or node in cached:
                continue
            arguments = [text(argument) for argument in entry.arguments]
            if node in inside:
                lines.append(f"{indent}double a{node} = 0.0;")
                lines.append(f"{indent}if ({arguments[0]} != 0.0) {{")
                lines += write(node, indent + "  ")
                lines.append(f"{indent}  a{node} = {arguments[1]};")
                lines.append(f"{indent}}}")
            elif entry.op in _CALLS:
                lines.append(f"{indent}const double a{node} = {_CALLS[entry.op]}({', '.join(arguments)});")
            else:
                lines.append(f"{indent}const double a{node} = {_TEXT[entry.op].format(*arguments)};")
        return lines

    return [*write(ROOT, "  "), *[f"  {target} = {text(node)};" for target, node in outputs]]
