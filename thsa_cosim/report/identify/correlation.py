"""Which parameters the data cannot distinguish: correlations of the estimates, and profile likelihoods."""

from itertools import combinations

import numpy as np

from thsa_cosim.report.folder import Json, Part
from thsa_cosim.report.parts import chart
from thsa_cosim.report.parts.chart import Chart
from thsa_cosim.report.parts.content import Block, Cell, Column, Figure, Section, Table
from thsa_cosim.report.parts.text import degrees, number_cell, quantity, text_cell

#: From here on two estimates move together so much that only their combination is known.
STRONG = 0.95


def correlation(part: Part) -> Section | None:
    """The section; None where no uncertainty was estimated."""
    points = [p for p in (part.result or {}).get("points", []) if len(p.get("correlation") or []) > 1]
    blocks: list[Block] = []
    if points:
        blocks.append(_pairs(points))
    profiles = [
        (p, name, c)
        for p in (part.result or {}).get("points", [])
        for name, c in p.get("profiles", {}).items()
    ]
    if profiles:
        blocks += [_profiles_figure(part, profiles), _profiles_table(profiles)]
    return (
        Section(f"{part.prefix}correlation", "Correlation of the estimates", tuple(blocks))
        if blocks
        else None
    )


def _pairs(points: list[Json]) -> Table:
    """One row per pair of parameters, one column per point."""
    found: dict[tuple[str, str], dict[int, float]] = {}
    for k, point in enumerate(points):
        matrix = point["correlation"]
        for (i, a), (j, b) in combinations(enumerate(point["parameters"]), 2):
            value = matrix[i][j]
            if value is not None:
                found.setdefault((a, b), {})[k] = float(value)
    columns = [Column("parameter", numeric=False), Column("with", numeric=False)]
    columns += [Column(degrees(p["temperature_degC"])) for p in points]
    rows = []
    for (a, b), values in found.items():
        cells = [_cell(values.get(k)) for k in range(len(points))]
        rows.append((text_cell(a), text_cell(b), *cells))
    note = f"From −1 to 1; marked from {STRONG:g} up in size: the data then determine only a combination of the two."
    return Table("Correlation of the estimates, pair by pair", columns, rows, note)


def _cell(value: float | None) -> Cell:
    if value is None:
        return number_cell(None)
    return Cell(f"{value:+.2f}".replace("-", "−"), value, "bad" if abs(value) >= STRONG else "")


def _profiles_figure(part: Part, profiles: list[tuple[Json, str, Json]]) -> Figure:
    columns = min(3, len(profiles))
    rows = -(-len(profiles) // columns)
    drawn = Chart(f"{part.prefix}profiles", rows=rows, columns=columns, row_height=220)
    for k, (point, name, curve) in enumerate(profiles):
        at = divmod(k, columns)
        costs = np.array([np.nan if c is None else c for c in curve["costs"]], dtype=np.float64)
        values = np.array([np.nan if v is None else v for v in curve["values"]], dtype=np.float64)
        order = np.argsort(values)
        rise = costs[order] - np.nanmin(costs)
        drawn.points(values[order], rise, "profile", at=at, joined=True, size=5, colour=chart.SIMULATED)
        drawn.axes(*at, x=f"{name} [{point['parameters'][name]['unit']}]", y="rise of the cost [1]")
        drawn.title(f"{name}, {degrees(point['temperature_degC'])}", *at)
    return drawn.build(
        "Profile likelihoods: the lowest cost with the parameter fixed, divided by the cost at the optimum."
    )


def _profiles_table(profiles: list[tuple[Json, str, Json]]) -> Table:
    columns = (Column("parameter", numeric=False), Column("temperature"), Column("from"), Column("to"))
    rows = []
    for point, name, curve in profiles:
        unit = point["parameters"][name]["unit"]
        low, high = curve["interval_95"]
        at = point["temperature_degC"]
        cells = [Cell("open" if end is None else quantity(end, unit), end) for end in (low, high)]
        rows.append((text_cell(name), Cell(degrees(at), at), *cells))
    return Table("95 % intervals by profile likelihood", columns, rows)
