"""Built-in operators and functions of Modelica (Modelica Language Specification 3.6, 3.7 and 10.3)."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import reduce
from typing import TYPE_CHECKING, Any

from thsa_cosim.errors import ModelicaError, did_you_mean
from thsa_cosim.modelica import arrays, overload
from thsa_cosim.modelica.arrays import Partial, Value, each, elements, fill, promote, shape, total
from thsa_cosim.modelica.overload import holds_records
from thsa_cosim.modelica.syntax import Syntax
from thsa_cosim.modelica.terms import Enumeration, Scalar, Term, make, plain, text

if TYPE_CHECKING:
    from thsa_cosim.modelica.evaluate import Evaluator

SCALAR = frozenset(
    re.findall(
        r"\w+",
        """
    sqrt exp log log10 sin cos tan asin acos atan atan2 sinh cosh tanh abs sign div mod rem floor ceil integer
        """,
    )
)
MATH_H = SCALAR - {"abs", "sign", "div", "mod", "rem", "integer"}  # by the same name in C's math.h
_REFUSED = frozenset(
    re.findall(
        r"\w+",
        """
    delay spatialDistribution inStream actualStream hold previous Clock subSample superSample
    shiftSample backSample noClock interval firstTick activeState initialState transition ticksInState
    timeInState
        """,
    )
)


def call(evaluator: Evaluator, expression: Syntax) -> Value:
    """Value of a function call."""
    name, arguments, named = expression.args
    if name.startswith("."):
        name = name[1:] if "." not in name[1:] else name
        expression = expression._replace(args=(name, arguments, named))
    given = evaluator.local.get(name)
    if isinstance(given, Partial):
        from thsa_cosim.modelica.function import invoke

        keyed = {**given.given, **{key: evaluator.value(a) for key, a in named.items()}}
        return invoke(evaluator, given.target, [evaluator.value(a) for a in arguments], keyed, expression)
    if name in _TABLE:
        return _TABLE[name](evaluator, expression)
    if name in SCALAR:
        values = [evaluator.value(a) for a in arguments]
        wanted = 2 if name in ("atan2", "div", "mod", "rem") else 1
        if len(values) != wanted or named:
            raise evaluator.error(expression, f"{name}() takes {wanted} argument{'s' * (wanted > 1)}.")
        return each(lambda *x: scalar(evaluator, name, *x), *values)
    if name in _REFUSED:
        raise evaluator.error(expression, f"{name}() is a limit of this exporter.")
    if name.startswith(("Connections.", ".Connections.")):
        return name.endswith("isRoot") or False
    target = evaluator.scope.find_class(name)
    if target is None:
        raise evaluator.error(
            expression, f"the function {name} is not known.{did_you_mean(name, [*_TABLE, *SCALAR])}"
        )
    from thsa_cosim.modelica.function import apply

    return apply(evaluator, target, expression)


def scalar(evaluator: Evaluator, name: str, *args: Scalar) -> Scalar:
    """A built-in function of scalars; inside a Modelica function it makes no events."""
    if evaluator.in_function and any(isinstance(a, Term) for a in args):
        if name in ("abs", "sign"):
            above = make("noEvent", make(">", args[0], 0))
            if name == "abs":
                return make("if", above, args[0], make("neg", args[0]))
            below = make("noEvent", make("<", args[0], 0))
            return make("if", above, 1, make("if", below, -1, 0))
        if name in ("floor", "ceil", "integer", "div", "mod", "rem"):
            return make("noEvent", make(name, *args))
    return make(name, *args)


def extreme(evaluator: Evaluator, op: str, a: Scalar, b: Scalar) -> Scalar:
    """max or min of two scalars."""
    if evaluator.in_function and (isinstance(a, Term) or isinstance(b, Term)):
        first = make("noEvent", make(">", a, b))
        return make("if", first, a, b) if op == "max" else make("if", first, b, a)
    return make(op, a, b)


def _extreme(evaluator: Evaluator, expression: Syntax) -> Value:
    name, arguments, _ = expression.args
    values = [evaluator.value(a) for a in arguments]
    if len(values) == 1:
        listed = elements(values[0])
        if not listed:
            return -math.inf if name == "max" else math.inf
        result = listed[0]
        for value in listed[1:]:
            result = extreme(evaluator, name, result, value)
        return result
    if len(values) != 2:
        raise evaluator.error(expression, f"{name}() takes two scalars or one array.")
    return extreme(evaluator, name, *values)


def _size(evaluator: Evaluator, expression: Syntax) -> Value:
    arguments = expression.args[1]
    found: Any
    if arguments[0].op == "name" and arguments[0].args[0][0] not in evaluator.local:
        found = evaluator.node(arguments[0])
        if not isinstance(found, list):
            found = evaluator.value(arguments[0])
    elif arguments[0].op == "name" and len(arguments[0].args) == 1 and not arguments[0].args[0][1]:
        found = evaluator.local[arguments[0].args[0][0]]  # its elements may have no values yet
    else:
        found = evaluator.value(arguments[0])
    sizes = list(shape(found))
    if len(arguments) == 1:
        return sizes
    index = evaluator.structural(arguments[1], "the dimension in size()")
    if index <= len(sizes):
        return sizes[index - 1]
    if 0 in sizes:
        return 0
    raise evaluator.error(expression, f"size(…, {index}) of an array with {len(sizes)} dimensions.")


def _sizes(evaluator: Evaluator, arguments: Any) -> list[int]:
    return [int(evaluator.structural(a, "the size of an array")) for a in arguments]


def _fill(evaluator: Evaluator, expression: Syntax) -> Value:
    arguments = expression.args[1]
    return fill(evaluator.value(arguments[0]), _sizes(evaluator, arguments[1:]))


def _constant_array(number: float) -> Callable[[Evaluator, Syntax], Value]:
    def made(evaluator: Evaluator, expression: Syntax) -> Value:
        return fill(number, _sizes(evaluator, expression.args[1]))

    return made


def _identity(evaluator: Evaluator, expression: Syntax) -> Value:
    (size,) = _sizes(evaluator, expression.args[1])
    return [[1 if i == j else 0 for j in range(size)] for i in range(size)]


def _diagonal(evaluator: Evaluator, expression: Syntax) -> Value:
    values = evaluator.value(expression.args[1][0])
    return [[v if i == j else 0 for j in range(len(values))] for i, v in enumerate(values)]


def _linspace(evaluator: Evaluator, expression: Syntax) -> Value:
    first, last, number = (evaluator.value(a) for a in expression.args[1])
    count = evaluator.fixed(number, expression, "the number of points of linspace()")
    step = make("/", make("-", last, first), count - 1)
    return [make("+", first, make("*", step, k)) for k in range(count)]


def _sum(evaluator: Evaluator, expression: Syntax) -> Value:
    return _reduced(evaluator, "+", expression)


def _product(evaluator: Evaluator, expression: Syntax) -> Value:
    return _reduced(evaluator, "*", expression)


def _reduced(evaluator: Evaluator, op: str, expression: Syntax) -> Value:
    """Sum or product of all elements."""
    value = evaluator.value(expression.args[1][0])
    if not holds_records(value):
        return total(elements(value)) if op == "+" else total(elements(value), "*", 1.0)
    if any(isinstance(v, list) for v in value):
        raise evaluator.error(expression, "a sum over a matrix of records is a limit of this exporter.")
    return reduce(lambda a, b: overload.operator(evaluator, op, [a, b], expression), value)


def _transpose(evaluator: Evaluator, expression: Syntax) -> Value:
    return arrays.transpose(evaluator.value(expression.args[1][0]))


def _cross(evaluator: Evaluator, expression: Syntax) -> Value:
    a, b = (evaluator.value(x) for x in expression.args[1])

    def minor(i: int, j: int) -> Scalar:
        return make("-", make("*", a[i], b[j]), make("*", a[j], b[i]))

    return [minor(1, 2), minor(2, 0), minor(0, 1)]


def _skew(evaluator: Evaluator, expression: Syntax) -> Value:
    x, y, z = evaluator.value(expression.args[1][0])
    return [[0, make("neg", z), y], [z, 0, make("neg", x)], [make("neg", y), x, 0]]


def _outer_product(evaluator: Evaluator, expression: Syntax) -> Value:
    a, b = (evaluator.value(x) for x in expression.args[1])
    return [[make("*", x, y) for y in b] for x in a]


def _symmetric(evaluator: Evaluator, expression: Syntax) -> Value:
    a = evaluator.value(expression.args[1][0])
    return [[a[min(i, j)][max(i, j)] for j in range(len(a))] for i in range(len(a))]


def _cat(evaluator: Evaluator, expression: Syntax) -> Value:
    dimension, *parts = expression.args[1]
    axis = evaluator.structural(dimension, "the dimension of cat()")
    return arrays.concatenate(axis, [evaluator.value(p) for p in parts])


def _scalar(evaluator: Evaluator, expression: Syntax) -> Value:
    (value,) = elements(evaluator.value(expression.args[1][0]))
    return value


def _vector(evaluator: Evaluator, expression: Syntax) -> Value:
    return elements(evaluator.value(expression.args[1][0]))


def _as_matrix(evaluator: Evaluator, expression: Syntax) -> Value:
    return promote(evaluator.value(expression.args[1][0]), 2)


def _array(evaluator: Evaluator, expression: Syntax) -> Value:
    arguments = expression.args[1]
    if len(arguments) == 1 and arguments[0].op == "comprehension":
        return evaluator.value(arguments[0])
    return [evaluator.value(a) for a in arguments]


def _ndims(evaluator: Evaluator, expression: Syntax) -> Value:
    return len(shape(evaluator.value(expression.args[1][0])))


def _unary_term(name: str) -> Callable[[Evaluator, Syntax], Value]:
    def made(evaluator: Evaluator, expression: Syntax) -> Value:
        value = evaluator.value(expression.args[1][0])
        return each(lambda x: make(name, x) if isinstance(x, Term) else _of_constant(name, x), value)

    return made


def _of_constant(name: str, value: Scalar) -> Scalar:
    return {"der": 0.0, "edge": False, "change": False}.get(name, value)


def _smooth(evaluator: Evaluator, expression: Syntax) -> Value:
    return evaluator.value(expression.args[1][1])


def _homotopy(evaluator: Evaluator, expression: Syntax) -> Value:
    _, arguments, named = expression.args
    actual = evaluator.value(named["actual"] if "actual" in named else arguments[0])
    simplified = evaluator.value(named["simplified"] if "simplified" in named else arguments[-1])
    return each(lambda a, b: Term("homotopy", (a, b)) if isinstance(a, Term) else a, actual, simplified)


def _initial(evaluator: Evaluator, expression: Syntax) -> Value:
    return Term("initial", ())


def _terminal(evaluator: Evaluator, expression: Syntax) -> Value:
    evaluator.warn(expression, "terminal() is taken as false: an FMU does not know when its simulation ends.")
    return False


def _sample(evaluator: Evaluator, expression: Syntax) -> Value:
    if len(expression.args[1]) != 2:
        raise evaluator.error(expression, "sample() of a clock is a limit of this exporter.")
    return Term("sample", tuple(evaluator.value(a) for a in expression.args[1]))


def _semi_linear(evaluator: Evaluator, expression: Syntax) -> Value:
    x, positive, negative = (evaluator.value(a) for a in expression.args[1])
    slope = make("if", make(">=", x, 0), positive, negative)
    return make("*", slope, x)


def _to_integer(evaluator: Evaluator, expression: Syntax) -> Value:
    value = evaluator.value(expression.args[1][0])
    return plain(value) if not isinstance(value, Term) else value


def _to_string(evaluator: Evaluator, expression: Syntax) -> Value:
    value = evaluator.value(expression.args[1][0])
    if isinstance(value, Term):
        return "…"
    return value.name if isinstance(value, Enumeration) else text(value)


def _instance_name(evaluator: Evaluator, expression: Syntax) -> Value:
    return evaluator.scope.instance.path or ""


def _cardinality(evaluator: Evaluator, expression: Syntax) -> Value:
    raise evaluator.error(expression, "cardinality() is deprecated and a limit of this exporter.")


_TABLE: dict[str, Callable[[Any, Syntax], Value]] = {
    "size": _size,
    "ndims": _ndims,
    "fill": _fill,
    "zeros": _constant_array(0.0),
    "ones": _constant_array(1.0),
    "identity": _identity,
    "diagonal": _diagonal,
    "linspace": _linspace,
    "sum": _sum,
    "product": _product,
    "min": _extreme,
    "max": _extreme,
    "transpose": _transpose,
    "cross": _cross,
    "skew": _skew,
    "outerProduct": _outer_product,
    "symmetric": _symmetric,
    "cat": _cat,
    "scalar": _scalar,
    "vector": _vector,
    "matrix": _as_matrix,
    "array": _array,
    "der": _unary_term("der"),
    "pre": _unary_term("pre"),
    "edge": _unary_term("edge"),
    "change": _unary_term("change"),
    "noEvent": _unary_term("noEvent"),
    "smooth": _smooth,
    "homotopy": _homotopy,
    "initial": _initial,
    "terminal": _terminal,
    "sample": _sample,
    "semiLinear": _semi_linear,
    "Integer": _to_integer,
    "String": _to_string,
    "getInstanceName": _instance_name,
    "cardinality": _cardinality,
}

__all__ = ["SCALAR", "ModelicaError", "call", "extreme", "scalar"]
