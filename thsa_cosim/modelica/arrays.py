"""Arrays as nested lists of scalars: shapes, element-wise operations, products."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica.terms import Scalar, make

Value = Any  # Scalar, Record, or a list of values


class _Unset:
    """A variable that has no value yet."""

    def __repr__(self) -> str:
        return "(no value)"


UNSET = _Unset()


class Record:
    """A value of a record class, by field."""

    __slots__ = ("fields", "type")

    def __init__(self, type_name: str, fields: dict[str, Value]) -> None:
        self.type = type_name
        self.fields = fields


@dataclass(frozen=True)
class Partial:
    """A function (its class) as a value, with some of its inputs given."""

    target: Any
    given: dict[str, Value]


def shape(value: Value) -> tuple[int, ...]:
    """Sizes of the dimensions; () for what is no array."""
    sizes = []
    while isinstance(value, list):
        sizes.append(len(value))
        if not value:
            break
        value = value[0]
    return tuple(sizes)


def elements(value: Value) -> list[Scalar]:
    """All scalars of an array, or of a record, row by row."""
    if isinstance(value, list):
        return [scalar for part in value for scalar in elements(part)]
    if isinstance(value, Record):
        return [scalar for part in value.fields.values() for scalar in elements(part)]
    return [value]


def unset(value: Value) -> bool:
    """Whether a value, or what an array begins or ends with, has not been assigned."""
    while isinstance(value, list) and value:
        if unset(value[0]):
            return True
        value = value[-1]
    return value is UNSET


def each(function: Callable[..., Scalar], *values: Value) -> Value:
    """Apply a function of scalars to arrays element by element; scalars count for every element."""
    lists = [v for v in values if isinstance(v, list)]
    if not lists:
        records = [v for v in values if isinstance(v, Record)]
        if records:
            fields = {}
            for key in records[0].fields:
                parts = [v.fields[key] if isinstance(v, Record) else v for v in values]
                fields[key] = each(function, *parts)
            return Record(records[0].type, fields)
        return function(*values)
    size = len(lists[0])
    if any(len(other) != size for other in lists):
        sizes = " and ".join(str(list(shape(v))) for v in lists)
        raise ModelicaError(f"the sizes {sizes} do not fit together")
    return [each(function, *(v[i] if isinstance(v, list) else v for v in values)) for i in range(size)]


def fill(value: Value, sizes: Sequence[int]) -> Value:
    """An array of the given sizes with the value everywhere."""
    if not sizes:
        return value
    return [fill(value, sizes[1:]) for _ in range(sizes[0])]


def total(values: Sequence[Scalar], op: str = "+", start: Scalar = 0.0) -> Scalar:
    """Sum (or product) of scalars."""
    if not values:
        return start
    result = values[0]
    for value in values[1:]:
        result = make(op, result, value)
    return result


def dot(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    """Scalar product."""
    if len(a) != len(b):
        raise ModelicaError(f"the sizes {[len(a)]} and {[len(b)]} do not fit together")
    return total([make("*", x, y) for x, y in zip(a, b, strict=True)])


def transpose(a: Value) -> Value:
    """Rows as columns."""
    return [list(column) for column in zip(*a, strict=True)]


def multiply(a: Value, b: Value) -> Value:
    """``a * b`` of Modelica: scalar, vector and matrix products."""
    rank_a, rank_b = len(shape(a)), len(shape(b))
    if rank_a == 0 or rank_b == 0:
        return each(lambda x, y: make("*", x, y), a, b)
    if rank_a == 1 and rank_b == 1:
        return dot(a, b)
    if rank_a == 2 and rank_b == 1:
        return [dot(row, b) for row in a]
    if rank_a == 1 and rank_b == 2:
        return [dot(a, column) for column in transpose(b)]
    if rank_a == 2 and rank_b == 2:
        columns = transpose(b)
        return [[dot(row, column) for column in columns] for row in a]
    raise ModelicaError(f"a product of arrays with {rank_a} and {rank_b} dimensions is not defined")


def binary(op: str, a: Value, b: Value) -> Value:
    """A binary operator of Modelica on values of any shape."""
    if op == "*":
        return multiply(a, b)
    if op == "+" and isinstance(a, str) and isinstance(b, str):
        return a + b
    if op == "^" and isinstance(a, list):
        return matrix_power(a, b)
    return each(lambda x, y: make(op.lstrip("."), x, y), a, b)


def matrix_power(a: Value, exponent: Value) -> Value:
    """A square matrix to a whole power."""
    if not isinstance(exponent, int) or exponent < 0:
        raise ModelicaError("a matrix has whole powers only")
    size = len(a)
    result: Value = [[1.0 if i == j else 0.0 for j in range(size)] for i in range(size)]
    for _ in range(exponent):
        result = multiply(result, a)
    return result


def concatenate(dimension: int, parts: Sequence[Value]) -> Value:
    """``cat(dimension, …)``."""
    if dimension == 1:
        return [row for part in parts for row in part]
    rows = max((len(part) for part in parts), default=0)
    return [concatenate(dimension - 1, [part[i] for part in parts if part]) for i in range(rows)]


def promote(value: Value, rank: int) -> Value:
    """A value with at least ``rank`` dimensions, those missing appended with size 1."""
    missing = rank - len(shape(value))

    def wrap(part: Value) -> Value:
        if isinstance(part, list):
            return [wrap(p) for p in part]
        for _ in range(missing):
            part = [part]
        return part

    return wrap(value) if missing > 0 else value
