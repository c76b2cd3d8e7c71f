"""The start from rest over the conditions: a table, and margins and start time over the first condition that varies."""

import numpy as np

from thsa_cosim.report.folder import Json, Part
from thsa_cosim.report.parts.chart import SERIES, Chart
from thsa_cosim.report.parts.content import Block, Cell, Column, Figure, Section, Table
from thsa_cosim.report.parts.text import number_cell
from thsa_cosim.report.tune.gains import limits_of, term_label

DRAWN = ("start_time", "breakaway_margin", "current_reserve", "voltage_reserve")


def start(part: Part) -> Section | None:
    """The section; None without ``[start]`` or before anything was scored."""
    result = part.result or {}
    rows = [row for row in result.get("start") or [] if row["gains"] == "after"]
    if not rows:
        return None
    units: Json = result.get("term_units", {})
    terms = [name for name in rows[0] if name in units]
    axes = [name for name in rows[0] if name not in units and name != "gains"]
    columns = [Column(*_axis(name)) for name in axes] + [Column(term_label(n), units[n]) for n in terms]
    bad = _broken(result, rows)
    table = [
        [*(number_cell(row[n]) for n in axes), *(_term(row[n], (k, n) in bad) for n in terms)]
        for k, row in enumerate(rows)
    ]
    note = "Breakaway margin: what the drive can give over what the start takes, less one. Red: beyond the limit."
    blocks: list[Block] = [Table("Start from rest after a soak, with the tuned gains", columns, table, note)]
    varying = [name for name in axes if len({row[name] for row in rows}) > 1]
    if varying:
        blocks.insert(0, _figure(part, rows, varying, [n for n in DRAWN if n in terms]))
    return Section(f"{part.prefix}start", "Start from rest", tuple(blocks))


def _term(value: float | None, broken: bool) -> Cell:
    return (
        Cell("does not start", None, "bad")
        if value is None
        else number_cell(value, mark="bad" if broken else "")
    )


def _broken(result: Json, rows: list[Json]) -> set[tuple[int, str]]:
    """Row and term of every value beyond its requirement."""
    limits = {r["metric"]: r for r in result.get("requirements", []) if r["metric"] in limits_of(result)}
    found = set()
    for k, row in enumerate(rows):
        for name, limit in limits.items():
            value = row.get(name)
            if value is not None and not (
                value <= limit["maximum"] if "maximum" in limit else value >= limit["minimum"]
            ):
                found.add((k, name))
    return found


def _axis(key: str) -> tuple[str, str]:
    """Name and unit of a condition's column: ``temperature_degC``, ``F_load_kN``."""
    name, _, unit = key.rpartition("_")
    return name, "°C" if unit == "degC" else unit


def _figure(part: Part, rows: list[Json], axes: list[str], terms: list[str]) -> Figure:
    first, *others = axes
    drawn = Chart(f"{part.prefix}start", columns=2, rows=-(-len(terms) // 2), row_height=240)
    families = list(dict.fromkeys(tuple(row[n] for n in others) for row in rows))
    name, unit = _axis(first)
    for k, term in enumerate(terms):
        at = divmod(k, 2)
        for rank, family in enumerate(families):
            members = sorted(
                (row for row in rows if tuple(row[n] for n in others) == family), key=lambda row: row[first]
            )
            x = np.array([row[first] for row in members], dtype=np.float64)
            y = np.array([np.nan if row[term] is None else row[term] for row in members])
            label = ", ".join(
                f"{_axis(n)[0]} = {v:g} {_axis(n)[1]}" for n, v in zip(others, family, strict=True)
            )
            drawn.line(x, y, label or "all", at=at, colour=SERIES[rank % len(SERIES)], width=1.8)
        drawn.axes(*at, x=f"{name} [{unit}]", y=term_label(term) + (" [s]" if term == "start_time" else ""))
    return drawn.build("With the tuned gains, over the conditions of the scenario.")
