"""Formulas over sampled signals, as a scenario writes them: ``"max(F_load*sgn(w_m), 0)*sgn(w_m)"``.

A text becomes a tree of the few operations below and nothing else; no Python code of a scenario is ever run.
"""

import ast
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from thsa_cosim.errors import ScenarioError, did_you_mean
from thsa_cosim.signals import FloatArray

Value = FloatArray | float

_OPERATORS: Mapping[type[ast.operator], Callable[[Value, Value], Value]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
}
_ARGUMENTS = {"der": 1, "sgn": 1, "abs": 1, "max": 2, "min": 2}


@dataclass(frozen=True)
class Formula:
    """A parsed formula: its ``text`` and the ``names`` that it uses."""

    text: str
    names: frozenset[str]
    tree: ast.expr

    def __call__(self, values: Mapping[str, FloatArray], step: float) -> FloatArray:
        """Value (n,) for signals (n,) every ``step`` s; ``der`` is the central difference per s."""
        size = next(iter(values.values())).size
        with np.errstate(all="ignore"):  # what is not finite is left out by whoever asked
            return np.asarray(np.broadcast_to(_evaluate(self.tree, values, step), (size,)), dtype=np.float64)


def parse_formula(text: str, known: Iterable[str], where: str) -> Formula:
    """A formula over the signals ``known``: numbers, + - * / **, der(), sgn(), abs(), max(,), min(,).

    Raises ScenarioError, which names the scenario's key ``where``, for anything else.
    """
    known = tuple(known)
    try:
        tree = ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ScenarioError(f"{where}: {text!r} is no formula; correct its spelling.") from None
    names: set[str] = set()
    _check(tree, names, known, text, where)
    return Formula(text, frozenset(names), tree)


def _check(node: ast.expr, names: set[str], known: tuple[str, ...], text: str, where: str) -> None:
    match node:
        case ast.Constant(value=int() | float()) if not isinstance(node.value, bool):
            return
        case ast.Name(id=name):
            if name not in known:
                raise ScenarioError(
                    f"{where}: {name!r} in {text!r} has no column.{did_you_mean(name, (*known, *_ARGUMENTS))}"
                )
            names.add(name)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            _check(left, names, known, text, where)
            _check(right, names, known, text, where)
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
            _check(operand, names, known, text, where)
        case ast.Call(func=ast.Name(id=function), args=arguments, keywords=[]):
            if function not in _ARGUMENTS:
                raise ScenarioError(
                    f"{where}: there is no function {function!r} in {text!r}."
                    f"{did_you_mean(function, _ARGUMENTS) or ' Known: ' + ', '.join(_ARGUMENTS) + '.'}"
                )
            if len(arguments) != _ARGUMENTS[function]:
                raise ScenarioError(
                    f"{where}: {function} in {text!r} takes {_ARGUMENTS[function]} argument(s), not {len(arguments)}."
                )
            for argument in arguments:
                _check(argument, names, known, text, where)
        case _:
            raise ScenarioError(
                f"{where}: {ast.unparse(node)!r} in {text!r} is not understood; use names of signals, numbers,"
                f" + - * / ** and {', '.join(_ARGUMENTS)}."
            )


def _evaluate(node: ast.expr, values: Mapping[str, FloatArray], step: float) -> Value:
    match node:
        case ast.Constant(value=value):
            return float(value)  # type: ignore[arg-type]
        case ast.Name(id=name):
            return values[name]
        case ast.BinOp(left=left, op=op, right=right):
            return _OPERATORS[type(op)](_evaluate(left, values, step), _evaluate(right, values, step))
        case ast.UnaryOp(op=op, operand=operand):
            inner = _evaluate(operand, values, step)
            return -inner if isinstance(op, ast.USub) else inner
        case ast.Call(func=ast.Name(id=function), args=arguments):
            return _call(function, [_evaluate(argument, values, step) for argument in arguments], step)
    raise AssertionError(f"{ast.dump(node)} passed the check")


def _call(function: str, arguments: list[Value], step: float) -> Value:
    first = arguments[0]
    match function:
        case "der":
            return np.gradient(first, step) if isinstance(first, np.ndarray) and first.size > 1 else 0.0
        case "sgn":
            return np.sign(first)
        case "abs":
            return np.abs(first)
        case "max":
            return np.maximum(first, arguments[1])
        case _:
            return np.minimum(first, arguments[1])
