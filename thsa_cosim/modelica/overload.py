"""Operators and constructors that operator records define (Modelica Language Specification 3.6, chapter 14)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from thsa_cosim.modelica.arrays import Record, Value, each, shape
from thsa_cosim.modelica.redeclaration import resolved
from thsa_cosim.modelica.scope import BUILTIN_TYPES, Element, Scope
from thsa_cosim.modelica.syntax import ClassDefinition, Component, Syntax
from thsa_cosim.modelica.terms import Scalar, make

if TYPE_CHECKING:
    from thsa_cosim.modelica.evaluate import Evaluator


def holds_records(value: Value) -> bool:
    """Whether a value is a record or an array of records."""
    while isinstance(value, list) and value:
        value = value[0]
    return isinstance(value, Record)


def operator(evaluator: Evaluator, op: str, values: Sequence[Value], where: Syntax) -> Value:
    """Value of an operator with one or two operands, of which one at least is a record or an array of records.

    Raises ModelicaError where the record does not define the operator for these operands.
    """
    if any(isinstance(v, list) for v in values):
        return _of_arrays(evaluator, op, values, where)
    plain_op = op.lstrip(".")
    records = [v for v in values if isinstance(v, Record)]
    for record in records:
        scope = evaluator.scope.find_class(record.type)
        if scope is None or scope.definition.name == "Complex":
            continue
        for operands in (values, _converted(evaluator, scope, values, where)):
            chosen = _fitting(_functions(scope, plain_op), operands)
            if chosen is not None:
                return _called(evaluator, chosen, operands, where)
        raise evaluator.error(
            where, f"the record {scope.qualified} defines no operator {plain_op} for these operands."
        )
    return _of_complex(evaluator, plain_op, values, where)


def constructed(
    evaluator: Evaluator, scope: Scope, positional: Sequence[Value], keyed: dict[str, Value], where: Syntax
) -> Value | None:
    """Value of the operator 'constructor' of a record; None where it defines none that fits."""
    if "operator" not in scope.definition.prefixes or scope.definition.name == "Complex":
        return None
    chosen = _fitting(_functions(scope, "constructor"), positional, keyed)
    return None if chosen is None else _called(evaluator, chosen, positional, where, keyed)


def _called(
    evaluator: Evaluator,
    function: Scope,
    operands: Sequence[Value],
    where: Syntax,
    keyed: dict[str, Value] | None = None,
) -> Value:
    from thsa_cosim.modelica.function import invoke

    return invoke(evaluator, function, list(operands), keyed or {}, where)


def _functions(scope: Scope, name: str) -> Iterator[Scope]:
    """The functions of an operator: itself, or those that it holds."""
    found = scope.member_class(f"'{name}'")
    if found is None:
        return
    if found.definition.kind == "function":
        yield found
        return
    for child, element in found.elements.items():
        if isinstance(element.declaration, ClassDefinition):
            inner = found.member_class(child)
            if inner is not None:
                yield inner


def _fitting(
    functions: Iterator[Scope], operands: Sequence[Value], keyed: dict[str, Value] | None = None
) -> Scope | None:
    """The first function that takes these operands."""
    for function in functions:
        inputs = [
            (name, element)
            for name, element in function.elements.items()
            if isinstance(element.declaration, Component) and "input" in element.declaration.prefixes
        ]
        given = dict(zip((name for name, _ in inputs), operands, strict=False)) | (keyed or {})
        if len(operands) > len(inputs) or set(given) - {name for name, _ in inputs}:
            continue
        if all(
            _fits(element, given[name]) if name in given else _optional(element) for name, element in inputs
        ):
            return function
    return None


def _optional(element: Element) -> bool:
    _, _, mod = resolved(element)
    return mod is not None and mod.binding is not None


def _fits(element: Element, value: Value) -> bool:
    declaration, owner, _ = resolved(element)
    if len(shape(value)) != len(declaration.dimensions):
        return False
    target = None if declaration.type in BUILTIN_TYPES else owner.find_class(declaration.type)
    wanted = target.qualified if target is not None and target.definition.kind == "record" else None
    while isinstance(value, list) and value:
        value = value[0]
    return (value.type if isinstance(value, Record) else None) == wanted


def _converted(evaluator: Evaluator, scope: Scope, values: Sequence[Value], where: Syntax) -> Sequence[Value]:
    """Operands that are no records, by the constructor of the record that takes one argument."""
    made = []
    for value in values:
        record = None if isinstance(value, Record) else constructed(evaluator, scope, [value], {}, where)
        made.append(value if record is None else record)
    return made


def _of_arrays(evaluator: Evaluator, op: str, values: Sequence[Value], where: Syntax) -> Value:
    """Element by element, or a record with every element."""
    arrays = [v for v in values if isinstance(v, list)]
    one = len(arrays) == 1 and len(values) == 2
    every = op.startswith(".") or len(values) == 1  # element by element by its meaning
    sums = op in ("+", "-") and len(arrays) == len(values)
    scaled = one and (op == "*" or (op == "/" and isinstance(values[0], list)))
    if not (every or sums or scaled):
        raise evaluator.error(where, f"the operator {op} on arrays of records is a limit of this exporter.")
    sizes = {len(v) for v in arrays}
    if len(sizes) > 1:
        raise evaluator.error(where, f"the operator {op} on arrays of different sizes.")
    turns = ([v[k] if isinstance(v, list) else v for v in values] for k in range(sizes.pop()))
    return [operator(evaluator, op, turn, where) for turn in turns]


def _of_complex(evaluator: Evaluator, op: str, values: Sequence[Value], where: Syntax) -> Value:
    """The operators of Complex, and sums of records that define none."""
    if len(values) == 1:
        return each(lambda x: make("neg", x), values[0])
    a, b = values
    if op in ("+", "-") and isinstance(a, Record) and isinstance(b, Record):
        return each(lambda x, y: make(op, x, y), a, b)
    both = [v if isinstance(v, Record) else Record("Complex", {"re": v, "im": 0.0}) for v in (a, b)]
    if not all({"re", "im"} == set(v.fields) for v in both):
        raise evaluator.error(where, f"the operator {op} on records is a limit of this exporter.")
    (x, y), (u, v) = ((r.fields["re"], r.fields["im"]) for r in both)
    kind = a.type if isinstance(a, Record) else b.type

    def complex_of(re: Scalar, im: Scalar) -> Record:
        return Record(kind, {"re": re, "im": im})

    def mul(p: Scalar, q: Scalar) -> Scalar:
        return make("*", p, q)

    if op in ("+", "-"):
        return complex_of(make(op, x, u), make(op, y, v))
    if op == "*":
        return complex_of(make("-", mul(x, u), mul(y, v)), make("+", mul(x, v), mul(y, u)))
    if op == "/":
        size = make("+", mul(u, u), mul(v, v))
        re = make("/", make("+", mul(x, u), mul(y, v)), size)
        return complex_of(re, make("/", make("-", mul(y, u), mul(x, v)), size))
    raise evaluator.error(where, f"the operator {op} on records is a limit of this exporter.")
