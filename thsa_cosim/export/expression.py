"""Flat Modelica expressions → CasADi expressions, with relations turned into modes.

A relation such as ``v > v_r`` that depends on a continuous variable becomes a *mode* m (0 or 1) with an event
indicator g = v - v_r; the mode is frozen between events (Modelica Language Specification 3.6, 8.5). Inside
``noEvent`` and over parameters alone the relation is evaluated where it stands.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import casadi as ca

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.flatten import Expression

_UNARY: dict[str, Callable[[ca.SX], ca.SX]] = {
    "Sin": ca.sin,
    "Cos": ca.cos,
    "Tan": ca.tan,
    "Asin": ca.asin,
    "Acos": ca.acos,
    "Atan": ca.atan,
    "Sinh": ca.sinh,
    "Cosh": ca.cosh,
    "Tanh": ca.tanh,
    "Exp": ca.exp,
    "Log": ca.log,
    "Log10": ca.log10,
    "Sqrt": ca.sqrt,
}
_ARITHMETIC: dict[str, Callable[[ca.SX, ca.SX], ca.SX]] = {
    "Add": lambda a, b: a + b,
    "Sub": lambda a, b: a - b,
    "Mul": lambda a, b: a * b,
    "Div": lambda a, b: a / b,
    "Exp": lambda a, b: power(a, b),
    "AddElem": lambda a, b: a + b,
    "SubElem": lambda a, b: a - b,
    "MulElem": lambda a, b: a * b,
    "DivElem": lambda a, b: a / b,
    "ExpElem": lambda a, b: power(a, b),
}
_RELATIONS = {"Gt": 1, "Ge": 1, "Lt": -1, "Le": -1}
_SYMBOLS = {
    "Add": "+", "Sub": "-", "Mul": "*", "Div": "/", "Exp": "^", "Gt": ">", "Ge": ">=", "Lt": "<", "Le": "<=",
    "And": "and", "Or": "or", "Eq": "==", "Neq": "<>",
}  # fmt: skip


def power(base: ca.SX, exponent: ca.SX) -> ca.SX:
    """``base**exponent``; small whole exponents become products, which are exact and have no log in derivatives."""
    if exponent.is_constant() and float(exponent) in (2.0, 3.0, 4.0):
        result = base
        for _ in range(int(float(exponent)) - 1):
            result = result * base
        return result
    return base**exponent


@dataclass
class Translator:
    """Translates expressions of one model and collects the modes that their relations need.

    ``symbols`` maps names to CasADi symbols or values; ``derivatives`` maps names to the symbols of their time
    derivatives; ``discrete`` names the symbols (parameters, constants) whose relations need no event. ``inline``
    holds Boolean variables by their defining expression.
    """

    symbols: dict[str, ca.SX]
    derivatives: Callable[[str], ca.SX]
    discrete: frozenset[str]
    inline: dict[str, Expression] = field(default_factory=dict)
    modes: list[ca.SX] = field(default_factory=list)
    indicators: list[ca.SX] = field(default_factory=list)

    def real(self, expression: Expression, events: bool = True) -> ca.SX:
        """Translate a Real or Integer expression; raises ModelicaError for what is not supported."""
        kind, body = next(iter(expression.items()))
        if kind == "Literal":
            value = next(iter(body["value"].values()))
            return ca.SX(float(value))
        if kind == "VarRef":
            return self._variable(reference(expression), events)
        if kind == "Unary":
            operand = self.real(body["rhs"], events)
            if body["op"] == "Minus":
                return -operand
            if body["op"] == "Plus":
                return operand
        if kind == "Binary" and body["op"] in _ARITHMETIC:
            return _ARITHMETIC[body["op"]](self.real(body["lhs"], events), self.real(body["rhs"], events))
        if kind == "If":
            return self._if(body, events)
        if kind == "BuiltinCall":
            return self._call(body, events)
        raise ModelicaError(f"The expression {text(expression)} ({kind}) is not supported by the exporter.")

    def condition(self, expression: Expression, events: bool = True) -> ca.SX:
        """Translate a Boolean expression to 0/1."""
        kind, body = next(iter(expression.items()))
        if kind == "Literal" and "Boolean" in body["value"]:
            return ca.SX(float(body["value"]["Boolean"]))
        if kind == "VarRef":
            return self._variable(reference(expression), events)
        if kind == "Unary" and body["op"] == "Not":
            return ca.logic_not(self.condition(body["rhs"], events))
        if kind == "Binary":
            if body["op"] == "And":
                return ca.logic_and(self.condition(body["lhs"], events), self.condition(body["rhs"], events))
            if body["op"] == "Or":
                return ca.logic_or(self.condition(body["lhs"], events), self.condition(body["rhs"], events))
            if body["op"] in _RELATIONS:
                difference = self.real(body["lhs"], events) - self.real(body["rhs"], events)
                return self._relation(_RELATIONS[body["op"]] * difference, events, body["op"] in ("Ge", "Le"))
        if kind == "BuiltinCall" and body["function"] == "NoEvent":
            return self.condition(body["args"][0], events=False)
        raise ModelicaError(f"The condition {text(expression)} is not supported by the exporter.")

    def _relation(self, difference: ca.SX, events: bool, inclusive: bool) -> ca.SX:
        timeless = all(str(symbol) in self.discrete for symbol in ca.symvar(difference))
        if timeless or not events:
            return difference >= 0 if inclusive else difference > 0
        for mode, indicator in zip(self.modes, self.indicators, strict=True):
            if ca.is_equal(indicator, difference, 20):
                return mode
        mode = ca.SX.sym(f"mode[{len(self.modes)}]")
        self.modes.append(mode)
        self.indicators.append(difference)
        return mode

    def _variable(self, name: str, events: bool) -> ca.SX:
        if name in self.inline:
            return self.condition(self.inline[name], events)
        if name not in self.symbols:
            raise ModelicaError(
                f"The variable {name} is not a scalar that the exporter knows; whole vectors are not supported."
            )
        return self.symbols[name]

    def _if(self, body: dict[str, Any], events: bool) -> ca.SX:
        result = self.real(body["else_branch"], events)
        for condition, branch in reversed(body["branches"]):
            result = select(self.condition(condition, events), self.real(branch, events), result)
        return result

    def _call(self, body: dict[str, Any], events: bool) -> ca.SX:
        function, arguments = body["function"], body["args"]
        if function == "Der":
            kind = next(iter(arguments[0]))
            if kind != "VarRef":
                raise ModelicaError(
                    f"der({text(arguments[0])}) is the derivative of an expression; name the expression first."
                )
            return self.derivatives(reference(arguments[0]))
        if function in _UNARY:
            return _UNARY[function](self.real(arguments[0], events))
        if function == "Atan2":
            return ca.atan2(self.real(arguments[0], events), self.real(arguments[1], events))
        if function == "NoEvent":
            return self.real(arguments[0], events=False)
        if function == "Smooth":
            return self.real(arguments[1], events)
        if function == "Homotopy":
            return self.real(arguments[0], events)
        if function in ("Max", "Min", "Abs", "Sign") and len(arguments) <= 2:
            return self._kinked(function, [self.real(argument, events) for argument in arguments], events)
        raise ModelicaError(
            f"The function {function.lower()}() in {text({'BuiltinCall': body})} is not supported by the exporter."
        )

    def _kinked(self, function: str, values: list[ca.SX], events: bool) -> ca.SX:
        first, second = values if len(values) == 2 else (values[0], ca.SX(0))
        above = self._relation(first - second, events, inclusive=False)
        if function == "Max":
            return select(above, first, second)
        if function == "Min":
            return select(above, second, first)
        if function == "Abs":
            return select(above, first, -first)
        below = self._relation(-first, events, inclusive=False)
        return above - below


def select(condition: ca.SX, yes: ca.SX, no: ca.SX) -> ca.SX:
    """``if condition then yes else no`` that does not let a NaN of the branch not taken through."""
    if condition.is_constant():
        return yes if float(condition) else no
    return ca.if_else(condition, yes, no)


def reference(expression: Expression) -> str:
    """Name of a VarRef with literal subscripts, such as ``motor.w`` or ``x[2]``."""
    body = expression["VarRef"]
    name = str(body["name"]["name"])
    for subscript in body["subscripts"]:
        index = subscript.get("Index", {}).get("value")
        if not isinstance(index, int):
            raise ModelicaError(
                f"The subscript of {name} is not a number; the exporter needs fixed subscripts."
            )
        name += f"[{index}]"
    return name


def text(expression: Expression) -> str:
    """An expression as Modelica text, for messages."""
    kind, body = next(iter(expression.items()))
    if kind == "Literal":
        return str(next(iter(body["value"].values())))
    if kind == "VarRef":
        return str(body["name"]["name"])
    if kind == "Unary":
        return {"Minus": "-", "Not": "not "}.get(body["op"], "") + text(body["rhs"])
    if kind == "Binary":
        return f"({text(body['lhs'])} {_SYMBOLS.get(body['op'], body['op'])} {text(body['rhs'])})"
    if kind == "BuiltinCall":
        return f"{body['function'].lower()}({', '.join(text(a) for a in body['args'])})"
    if kind == "If":
        branches = " else".join(f"if {text(c)} then {text(b)}" for c, b in body["branches"])
        return f"{branches} else {text(body['else_branch'])}"
    return kind


def equation_text(residual: Expression) -> str:
    """A residual as ``lhs = rhs``."""
    body = residual.get("Binary")
    if body is not None and body["op"] == "Sub":
        return f"{text(body['lhs'])} = {text(body['rhs'])}"
    return f"{text(residual)} = 0"
