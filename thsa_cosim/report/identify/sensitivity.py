"""What ``check SCENARIO --sensitivity`` prints: expected standard errors before any search."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from thsa_cosim.identify.sensitivity import ParameterSensitivity, PointSensitivity
from thsa_cosim.report.parts.text import number


def sensitivity_dict(points: Sequence[PointSensitivity]) -> list[dict[str, Any]]:
    """The same as JSON types."""
    return [asdict(point) for point in points]


def print_sensitivity(console: Console, points: Sequence[PointSensitivity]) -> None:
    """Print one row a parameter; several points with the same parameters share a table, with the range over them."""
    for point in points:
        if point.failure:
            text = f"{point.label}: the start values cannot be simulated ({point.failure}); give other start values."
            console.print(Text(text), highlight=False)
    groups: dict[tuple[str, ...], list[PointSensitivity]] = {}
    for point in points:
        if not point.failure:
            groups.setdefault(tuple(p.name for p in point.parameters), []).append(point)
    for group in groups.values():
        console.print(_table(group))
        for names, values in _confounded(group).items():
            text = f"{names[0]} and {names[1]} are confounded: correlation {number(max(values, key=abs), 3)}"
            console.print(Text(text + f" at {_places(len(values), len(group))}."), highlight=False)
    console.print(
        "Expected: a local estimate at the start values, if the model explains the recordings down to white noise."
        " Where it does not, the errors become larger.",
        highlight=False,
    )


def _table(group: Sequence[PointSensitivity]) -> Table:
    title = f"Sensitivity before the search, {_title(group)}"
    table = Table(title=Text(title), title_justify="left")
    for heading in ("parameter", "unit", "at", "expected standard error"):
        table.add_column(heading, overflow="fold", justify="left" if heading == "parameter" else "right")
    table.add_column("rms change / noise for a tenth of the bounds", overflow="fold")
    for i, first in enumerate(group[0].parameters):
        rows = [point.parameters[i] for point in group]
        responses = ", ".join(
            f"{signal} {_spread([r.responses[signal] for r in rows])}" for signal in first.responses
        )
        at = _spread([row.value for row in rows])
        table.add_row(Text(first.name), Text(first.unit), at, _expected(rows), Text(responses))
    return table


def _title(group: Sequence[PointSensitivity]) -> str:
    labels = [point.label for point in group]
    return labels[0] if len(labels) == 1 else f"{len(labels)} points from {labels[0]} to {labels[-1]}"


def _expected(rows: Sequence[ParameterSensitivity]) -> Text:
    errors = [row.stderr for row in rows if row.stderr is not None]
    reasons = list(dict.fromkeys(row.reason for row in rows if row.reason))
    if not reasons:
        return Text(f"± {_spread(errors)}")
    where = (
        ""
        if len(errors) == 0
        else f" at {_places(len(rows) - len(errors), len(rows))}; else ± {_spread(errors)}"
    )
    return Text(f"not determined{where}: {reasons[0]}", style="yellow")


def _spread(values: Sequence[float]) -> str:
    low, high = number(min(values), 3), number(max(values), 3)
    return low if low == high else f"{low} … {high}"


def _confounded(group: Sequence[PointSensitivity]) -> dict[tuple[str, str], list[float]]:
    found: dict[tuple[str, str], list[float]] = {}
    for point in group:
        for one, other, correlation in point.confounded:
            found.setdefault((one, other), []).append(correlation)
    return found


def _places(count: int, of: int) -> str:
    if of == 1:
        return "this point"
    return "every point" if count == of else f"{count} of {of} points"
