"""Scalar expressions over the variables of a flattened model, with constants folded.

A value is a Python number or bool, an ``Enumeration`` literal, or a ``Term``. Terms are shared, not copied: a walk over
them has to remember what it has seen (by ``id``).
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Enumeration:
    """A literal of an enumeration type; ``index`` counts from 1."""

    type: str
    name: str
    index: int


class Term:
    """An operation on values; ``op`` is one of

    ``ref`` (a variable's name), ``der``, ``pre`` (a term), ``+ - * / ^ neg``, ``< <= > >= == <>``, ``and or not``,
    ``if`` (condition, value, otherwise), ``noEvent``, ``smooth`` (order, value), ``homotopy`` (actual, simplified),
    ``initial``, ``sample`` (start, interval), ``edge``, ``change`` or the name of a built-in function.
    """

    __slots__ = ("args", "op")

    def __init__(self, op: str, args: tuple[Any, ...]) -> None:
        self.op = op
        self.args = args

    def __repr__(self) -> str:
        return text(self)


Scalar = Any  # int, float, bool, str, Enumeration or Term
RELATIONS = {"<": "<", "<=": "<=", ">": ">", ">=": ">=", "==": "==", "<>": "!="}

_FOLD: dict[str, Callable[..., Any]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "^": lambda a, b: float(a) ** float(b),
    "neg": lambda a: -a,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b,
    "<>": lambda a, b: a != b,
    "and": lambda a, b: bool(a) and bool(b),
    "or": lambda a, b: bool(a) or bool(b),
    "not": lambda a: not a,
    "abs": abs,
    "sign": lambda a: (a > 0) - (a < 0),
    "min": min,
    "max": max,
    "sqrt": math.sqrt,
    "exp": math.exp,
    "log": math.log,
    "log10": math.log10,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "atan2": math.atan2,
    "sinh": math.sinh,
    "cosh": math.cosh,
    "tanh": math.tanh,
    "floor": math.floor,
    "ceil": math.ceil,
    "integer": math.floor,
    "div": lambda a, b: math.trunc(a / b) if isinstance(a, float) or isinstance(b, float) else _whole(a, b),
    "mod": lambda a, b: a - math.floor(a / b) * b,
    "rem": lambda a, b: a - math.trunc(a / b) * b,
}


def _whole(a: int, b: int) -> int:
    quotient = abs(a) // abs(b)
    return quotient if (a < 0) == (b < 0) else -quotient


def plain(value: Scalar) -> Any:
    """A constant as a number; an enumeration literal as its ordinal."""
    return value.index if isinstance(value, Enumeration) else value


def constant(value: Scalar) -> bool:
    """Whether a value is known at export."""
    return not isinstance(value, Term)


def make(op: str, *args: Scalar) -> Scalar:
    """The operation on the arguments, folded where they are constant."""
    if op in _FOLD and not any(isinstance(a, Term) for a in args):
        values = [plain(a) for a in args]
        if op in ("==", "<>") and any(isinstance(v, str) for v in values):
            return (values[0] == values[1]) == (op == "==")
        try:
            folded = _FOLD[op](*values)
        except (ArithmeticError, ValueError, TypeError):
            folded = None
        if folded is not None and not isinstance(folded, complex):
            return folded
    simple = _simplified(op, args)
    return Term(op, args) if simple is None else simple


def _simplified(op: str, args: tuple[Scalar, ...]) -> Scalar | None:
    if op in ("+", "-", "*", "/"):
        a, b = args
        zero_a, zero_b = _is(a, 0), _is(b, 0)
        if op == "+":
            return b if zero_a else a if zero_b else None
        if op == "-":
            return a if zero_b else make("neg", b) if zero_a else None
        if op == "*":
            if zero_a or zero_b:
                return 0.0
            return b if _is(a, 1) else a if _is(b, 1) else None
        return a if _is(b, 1) else 0.0 if zero_a and not zero_b else None
    if op == "^" and _is(args[1], 1):
        return args[0]
    if op == "neg" and isinstance(args[0], Term) and args[0].op == "neg":
        return args[0].args[0]
    if op == "and":
        a, b = args
        if a is False or b is False:
            return False
        return b if a is True else a if b is True else None
    if op == "or":
        a, b = args
        if a is True or b is True:
            return True
        return b if a is False else a if b is False else None
    if op == "noEvent" and not isinstance(args[0], Term):
        return args[0]
    if op == "not" and isinstance(args[0], Term) and args[0].op == "not":
        return args[0].args[0]
    if op == "if":
        condition, yes, no = args
        if not isinstance(condition, Term):
            return yes if condition else no
        if yes is no or (not isinstance(yes, Term) and not isinstance(no, Term) and same(yes, no)):
            return yes
    return None


def _is(value: Scalar, number: int) -> bool:
    return not isinstance(value, (Term, bool, str, Enumeration)) and value == number


def same(a: Scalar, b: Scalar) -> bool:
    """Whether two constants are equal and of one kind."""
    return type(a) is type(b) and bool(a == b)


def walk(values: Any) -> Iterator[Term]:
    """Every term below the values, each once."""
    seen: set[int] = set()
    stack = list(values)
    while stack:
        top = stack.pop()
        if isinstance(top, Term) and id(top) not in seen:
            seen.add(id(top))
            yield top
            stack.extend(top.args)


def names(value: Scalar) -> set[str]:
    """Names of the variables that a value refers to."""
    return {term.args[0] for term in walk([value]) if term.op == "ref"}


def substitute(value: Scalar, replace: Callable[[Term], Scalar | None], done: dict[int, Scalar]) -> Scalar:
    """Rebuild a value with terms replaced; ``replace`` returns None for what stays; ``done`` remembers by id."""
    if not isinstance(value, Term):
        return value
    if id(value) not in done:
        found = replace(value)
        if found is None:
            args = tuple(substitute(a, replace, done) for a in value.args)
            unchanged = all(a is b for a, b in zip(args, value.args, strict=True))
            found = value if unchanged else make(value.op, *args)
        done[id(value)] = found
    return done[id(value)]


def text(value: Scalar, depth: int = 12) -> str:
    """A value as Modelica text, for messages; what lies deep is shortened to …"""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Enumeration):
        return f"{value.type.rsplit('.', 1)[-1]}.{value.name}"
    if not isinstance(value, Term):
        return (
            f'"{value}"'
            if isinstance(value, str)
            else f"{value:g}"
            if isinstance(value, float)
            else str(value)
        )
    if depth == 0:
        return "…"
    op, args = value.op, value.args
    if op == "ref":
        return str(args[0])
    parts = [text(a, depth - 1) for a in args]
    if op in ("neg", "not"):
        return f"-{parts[0]}" if op == "neg" else f"not {parts[0]}"
    if op in _INFIX:
        return f"({parts[0]} {op} {parts[1]})"
    if op == "if":
        return f"(if {parts[0]} then {parts[1]} else {parts[2]})"
    return f"{op}({', '.join(parts)})"


_INFIX = frozenset(("+", "-", "*", "/", "^", "and", "or", *RELATIONS))
