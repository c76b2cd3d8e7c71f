"""States that parameters hold at rest: their derivative is 0 whatever else happens, as a coefficient is switched off.

The solver leaves them out of its linear algebra, so that a model with many effects costs what those that act cost.
"""

from collections.abc import Set

import casadi as ca

_OF_FIRST = {ca.OP_NEG, ca.OP_TWICE, ca.OP_SQ, ca.OP_DIV}


def moving(rhs: ca.SX, parameters: Set[str]) -> ca.SX:
    """(n_x,) of parameters alone: 0 where the derivative of a state is 0 whatever else happens, else 1."""
    known: dict[int, ca.SX] = {}
    dense = ca.densify(rhs)
    return ca.vertcat(*(_may_differ(dense.nz[k], parameters, known) for k in range(dense.numel())))


def _may_differ(value: ca.SX, parameters: Set[str], known: dict[int, ca.SX]) -> ca.SX:
    """0 where ``value`` is sure to be 0, as a function of parameters."""
    if value.is_constant():
        return ca.SX(float(float(value) != 0.0))
    key = value.element_hash()
    if key not in known:
        known[key] = _of_operation(value, parameters, known)
    return known[key]


def _of_operation(value: ca.SX, parameters: Set[str], known: dict[int, ca.SX]) -> ca.SX:
    if value.is_symbolic():
        return ca.SX(1.0)
    operation = value.op()
    if operation == ca.OP_IF_ELSE_ZERO:
        inner = _may_differ(value.dep(1), parameters, known)
        condition = value.dep(0)
        if not {symbol.name() for symbol in ca.symvar(condition)} <= parameters:
            return inner
        return condition if _is_one(inner) else ca.logic_and(condition, inner)
    if operation in _OF_FIRST:
        return _may_differ(value.dep(0), parameters, known)
    if operation in (ca.OP_MUL, ca.OP_ADD, ca.OP_SUB):
        one, other = (_may_differ(value.dep(k), parameters, known) for k in (0, 1))
        if operation == ca.OP_MUL:
            return other if _is_one(one) else one if _is_one(other) else ca.logic_and(one, other)
        return ca.SX(1.0) if _is_one(one) or _is_one(other) else ca.logic_or(one, other)
    return ca.SX(1.0)


def _is_one(value: ca.SX) -> bool:
    return value.is_constant() and float(value) == 1.0
