"""The tables of Modelica.Blocks, whose implementation in C is replaced: piecewise polynomials as terms.

Columns of numbers are interpolated with constant or linear segments or by Akima splines (``ContinuousDerivative``),
as ``Modelica.Blocks.Types.Smoothness`` and ``Extrapolation`` say (H. Akima, J. ACM 17 (1970) 589).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from thsa_cosim.modelica.arrays import Value
from thsa_cosim.modelica.syntax import Syntax
from thsa_cosim.modelica.terms import Scalar, Term, make, plain

if TYPE_CHECKING:
    from thsa_cosim.modelica.evaluate import Evaluator

LINEAR, AKIMA, CONSTANT = 1, 2, 3
HOLD, LAST_TWO, PERIODIC, NONE = 1, 2, 3, 4


class Table:
    """What an ExternalCombiTable object holds; rows are lists of numbers."""

    def __init__(
        self, rows: list[list[float]], smoothness: int, extrapolation: int, columns: list[int]
    ) -> None:
        self.rows = rows
        self.smoothness = smoothness
        self.extrapolation = extrapolation
        self.columns = columns
        self.start = 0.0
        self.shift = 0.0


def _numbers(evaluator: Evaluator, where: Syntax, value: Value) -> Any:
    return evaluator.fixed(value, where, "the data of a table")


def _from_file(evaluator: Evaluator, where: Syntax, table_name: Any, file_name: Any) -> None:
    if file_name not in ("NoName", "", None) or table_name not in ("NoName", "", None):
        raise evaluator.error(
            where, "a table that is read from a file or a usertab is a limit of this exporter; give its data."
        )


def _table1(evaluator: Evaluator, where: Syntax, inputs: list[Value]) -> Value:
    name, file, rows, columns, smoothness, *rest = inputs
    _from_file(evaluator, where, name, file)
    extrapolation = plain(rest[0]) if rest else LAST_TWO
    return Table(
        _numbers(evaluator, where, rows),
        plain(smoothness),
        extrapolation,
        _numbers(evaluator, where, columns),
    )


def _time_table(evaluator: Evaluator, where: Syntax, inputs: list[Value]) -> Value:
    name, file, rows, start, columns, smoothness, extrapolation, shift, *_ = inputs
    _from_file(evaluator, where, name, file)
    made = Table(
        _numbers(evaluator, where, rows),
        plain(smoothness),
        plain(extrapolation),
        _numbers(evaluator, where, columns),
    )
    made.start = _numbers(evaluator, where, start)
    made.shift = _numbers(evaluator, where, shift)
    return made


def _table2(evaluator: Evaluator, where: Syntax, inputs: list[Value]) -> Value:
    name, file, rows, smoothness, *rest = inputs
    _from_file(evaluator, where, name, file)
    extrapolation = plain(rest[0]) if rest else LAST_TWO
    return Table(_numbers(evaluator, where, rows), plain(smoothness), extrapolation, [])


def _value1(evaluator: Evaluator, where: Syntax, inputs: list[Value]) -> Value:
    table, column, u = inputs[:3]
    index = table.columns[evaluator.fixed(column, where, "the column of a table") - 1] - 1
    return interpolate(
        evaluator, where, table, [row[0] for row in table.rows], [row[index] for row in table.rows], u
    )


def _time_value(evaluator: Evaluator, where: Syntax, inputs: list[Value]) -> Value:
    table, column, time = inputs[:3]
    index = table.columns[evaluator.fixed(column, where, "the column of a table") - 1] - 1
    t = [row[0] + table.shift for row in table.rows]
    inside = interpolate(evaluator, where, table, t, [row[index] for row in table.rows], time, events=True)
    if table.start <= t[0] and table.start <= 0.0:
        return inside
    return make("if", make(">=", time, table.start), inside, 0.0)


def _value2(evaluator: Evaluator, where: Syntax, inputs: list[Value]) -> Value:
    table, u1, u2 = inputs[:3]
    if table.smoothness != LINEAR:
        raise evaluator.error(
            where, "a two-dimensional table with other than linear segments is a limit of this exporter."
        )
    x = [row[0] for row in table.rows[1:]]
    y = table.rows[0][1:]
    along = [interpolate(evaluator, where, table, y, row[1:], u2) for row in table.rows[1:]]
    return interpolate(evaluator, where, table, x, along, u1)


def interpolate(
    evaluator: Evaluator,
    where: Syntax,
    table: Table,
    x: list[float],
    y: list[Scalar],
    u: Scalar,
    events: bool = False,
) -> Scalar:
    """y(u) through the points; two points of one x are a jump."""
    if table.extrapolation == NONE:
        raise evaluator.error(
            where, "a table without extrapolation is a limit of this exporter; choose HoldLastPoint."
        )
    if table.smoothness not in (LINEAR, AKIMA, CONSTANT):
        raise evaluator.error(where, "a table with monotone splines is a limit of this exporter.")
    if any(b < a or (b == a and table.smoothness == AKIMA) for a, b in pairwise(x)):
        raise evaluator.error(where, "the first column of the table has to rise.")
    if len(x) == 1:
        return y[0]
    if table.extrapolation == PERIODIC:
        period = x[-1] - x[0]
        turns = make("floor", make("/", make("-", u, x[0]), period))
        u = make("-", u, make("*", period, turns if events else make("noEvent", turns)))
    slopes = [
        make("/", make("-", y[k + 1], y[k]), x[k + 1] - x[k]) if x[k + 1] > x[k] else 0.0
        for k in range(len(x) - 1)
    ]
    rates = _akima(slopes) if table.smoothness == AKIMA and len(x) > 2 else None
    pieces = list(y[:-1]) if table.smoothness == CONSTANT else _pieces(x, y, u, slopes, rates)

    def below(limit: float) -> Scalar:
        relation = make("<", u, limit)
        return relation if events else make("noEvent", relation)

    def beyond(end: int) -> Scalar:
        """The value outside, at the first (0) or last (-1) point and on."""
        if table.extrapolation == HOLD or table.smoothness == CONSTANT:
            return y[end]
        slope = slopes[end] if rates is None else rates[end]
        return make("+", y[end], make("*", slope, make("-", u, x[end])))

    result = beyond(-1)
    for k in range(len(pieces), 0, -1):
        if x[k] > x[k - 1]:
            result = make("if", below(x[k]), pieces[k - 1], result)
    return make("if", below(x[0]), beyond(0), result)


def _pieces(
    x: list[float], y: list[Scalar], u: Scalar, slopes: list[Scalar], rates: list[float] | None
) -> list[Scalar]:
    """A value for every interval of x: linear, or cubic with the rates at the points."""
    found = []
    for k, slope in enumerate(slopes):
        distance = make("-", u, x[k])
        value = make("+", y[k], make("*", slope, distance))
        if rates is not None:
            h = x[k + 1] - x[k]
            bend = make(
                "/", make("-", make("-", make("*", 3, slope), make("*", 2, rates[k])), rates[k + 1]), h
            )
            twist = make("/", make("-", make("+", rates[k], rates[k + 1]), make("*", 2, slope)), h * h)
            inner = make("+", bend, make("*", twist, distance))
            value = make("+", y[k], make("*", distance, make("+", rates[k], make("*", distance, inner))))
        found.append(value)
    return found


def _akima(slopes: list[Scalar]) -> list[float]:
    m = [float(s) for s in slopes if not isinstance(s, Term)]
    m = [3 * m[0] - 2 * m[1], 2 * m[0] - m[1], *m, 2 * m[-1] - m[-2], 3 * m[-1] - 2 * m[-2]]
    rates = []
    for k in range(len(slopes) + 1):
        left, right = abs(m[k + 1] - m[k]), abs(m[k + 3] - m[k + 2])
        rates.append(
            (right * m[k + 1] + left * m[k + 2]) / (left + right)
            if left + right
            else (m[k + 1] + m[k + 2]) / 2
        )
    return rates


def _first(evaluator: Evaluator, where: Syntax, inputs: list[Value]) -> Value:
    return inputs[0].rows[0][0] + inputs[0].shift


def _last(evaluator: Evaluator, where: Syntax, inputs: list[Value]) -> Value:
    return inputs[0].rows[-1][0] + inputs[0].shift


def _never(evaluator: Evaluator, where: Syntax, inputs: list[Value]) -> Value:
    return 1e60


FUNCTIONS: dict[str, Callable[[Any, Syntax, list[Value]], Value]] = {
    "ModelicaStandardTables_CombiTable1D_init2": _table1,
    "ModelicaStandardTables_CombiTable1D_init3": _table1,
    "ModelicaStandardTables_CombiTable1D_getValue": _value1,
    "ModelicaStandardTables_CombiTable1D_minimumAbscissa": _first,
    "ModelicaStandardTables_CombiTable1D_maximumAbscissa": _last,
    "ModelicaStandardTables_CombiTimeTable_init2": _time_table,
    "ModelicaStandardTables_CombiTimeTable_init3": _time_table,
    "ModelicaStandardTables_CombiTimeTable_getValue": _time_value,
    "ModelicaStandardTables_CombiTimeTable_minimumTime": _first,
    "ModelicaStandardTables_CombiTimeTable_maximumTime": _last,
    "ModelicaStandardTables_CombiTimeTable_nextTimeEvent": _never,
    "ModelicaStandardTables_CombiTable2D_init2": _table2,
    "ModelicaStandardTables_CombiTable2D_init3": _table2,
    "ModelicaStandardTables_CombiTable2D_getValue": _value2,
}
