"""A schedule of gains: over its conditions, and how it stands in the sweep between the nodes."""

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from thsa_cosim.report.folder import Json, Part
from thsa_cosim.report.parts import chart
from thsa_cosim.report.parts.chart import Chart
from thsa_cosim.report.parts.content import Block, Column, Figure, Section, Table
from thsa_cosim.report.parts.text import count, number_cell, text_cell
from thsa_cosim.report.tune.gains import limits_of, term_label, term_rows
from thsa_cosim.report.tune.responses import set_colours
from thsa_cosim.signals import FloatArray

CHECK = "schedule_check.csv"


def schedule(part: Part) -> Section | None:
    """The section; None for a tuning of a single set of gains."""
    result = part.result or {}
    rows: list[Json] = result.get("schedule") or []
    if len(rows) < 2:
        return None
    gain_units: Json = result.get("units", {})
    axes = [key for key in rows[0] if key not in gain_units]
    columns = [Column(*_axis(key)) for key in axes] + [Column(n, u) for n, u in gain_units.items()]
    table = [[number_cell(row.get(key)) for key in (*axes, *gain_units)] for row in rows]
    blocks: list[Block] = [
        _figure(part, rows, axes, gain_units),
        Table("Schedule: linear between nodes, constant beyond the ends", columns, table),
    ]
    check: Json | None = result.get("schedule_check")
    if check:
        if (part.folder / CHECK).is_file():
            blocks.append(_check_figure(part, result, axes[0]))
        blocks.append(_check_table(result, check))
    return Section(f"{part.prefix}schedule", "Schedule", tuple(blocks))


def _axis(key: str) -> tuple[str, str]:
    """Name and unit of a condition's column in result.json: ``temperature_degC``, ``F_load_kN``."""
    name, _, unit = key.rpartition("_")
    return name, "°C" if unit == "degC" else unit


def _figure(part: Part, rows: list[Json], axes: list[str], gain_units: Json) -> Figure:
    names = list(gain_units)
    drawn = Chart(f"{part.prefix}schedule", columns=len(names), row_height=280)
    second = axes[1] if len(axes) > 1 else None
    families = sorted({row[second] for row in rows}) if second else [None]
    single: Json = (part.result or {}).get("gains", {})
    own = [g for g in (part.result or {}).get("groups", []) if g.get("at")]
    for k, name in enumerate(names):
        for rank, family in enumerate(families):
            members = [row for row in rows if second is None or row[second] == family]
            label = (
                "schedule"
                if second is None
                else f"schedule at {_axis(second)[0]} = {family:g} {_axis(second)[1]}"
            )
            x, y = [row[axes[0]] for row in members], [row[name] for row in members]
            drawn.line(x, y, label, at=(0, k), colour=chart.SERIES[rank % len(chart.SERIES)], width=2)
        if own and second is None:
            x, y = [next(iter(g["at"].values())) for g in own], [g["gains"][name] for g in own]
            drawn.points(x, y, "nodes' own optima", at=(0, k), symbol="circle-open", size=8)
        if name in single:
            ends = [min(row[axes[0]] for row in rows), max(row[axes[0]] for row in rows)]
            drawn.line(
                ends, [single[name]] * 2, "best single set", at=(0, k), colour=chart.MEASURED, dash="dash"
            )
        label, unit = _axis(axes[0])
        drawn.axes(
            0, k, x=f"{label} [{unit}]", y=f"{name} [{gain_units[name]}]", y_options={"rangemode": "tozero"}
        )
    return drawn.build("The gains over their first condition, and what the search of each node found.")


def _check_figure(part: Part, result: Json, axis: str) -> Figure:
    """Every required term over the schedule's first condition, worst over the others, with its limit."""
    places, sets = _read_check(part.folder / CHECK, axis)
    wanted: list[Json] = result.get("requirements", [])
    columns = min(3, max(len(wanted), 1))
    rows = max(-(-len(wanted) // columns), 1)
    drawn = Chart(f"{part.prefix}schedule-check", rows=rows, columns=columns, row_height=190)
    name, unit = _axis(axis)
    colours = set_colours(sets)
    for k, requirement in enumerate(wanted):
        at, metric = divmod(k, columns), requirement["metric"]
        upper = "maximum" in requirement
        for label, terms in sets.items():
            values = np.abs(terms[metric]) if metric == "steady_state_error" else terms[metric]
            x = np.unique(places[label])
            y = [_worst(values[places[label] == one], upper) for one in x]
            drawn.line(x, y, label, at=at, colour=colours[label], width=1.8)
        drawn.level(requirement["maximum" if upper else "minimum"], at=at)
        shown = "" if requirement["unit"] == "1" else f" {requirement['unit']}"
        drawn.title(f"{term_label(metric)} {limits_of(result)[metric]}{shown}", *at)
        below = k + columns >= len(wanted)
        drawn.axes(
            *at, y=f"{term_label(metric)} [{requirement['unit']}]", x=f"{name} [{unit}]" if below else ""
        )
        drawn.axes(*at, log_y=metric == "steady_state_error", dtick_y=1)
    return drawn.build(
        "The sweep between the nodes: required terms, worst over the other conditions; dotted: the limit."
    )


Terms = dict[str, "np.ndarray[tuple[int], np.dtype[np.float64]]"]


def _worst(values: FloatArray, upper: bool) -> float:
    """The worst of the values that exist (a response may never settle); NaN if none does."""
    found = values[~np.isnan(values)]
    return float(np.max(found) if upper else np.min(found)) if found.size else float("nan")


def _read_check(path: Path, axis: str) -> tuple[Terms, dict[str, Terms]]:
    """Places on ``axis`` and terms per set of gains."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    labels = dict.fromkeys(row["gains"] for row in rows)
    start = list(rows[0]).index("cost") + 1
    metrics = list(rows[0])[start:]

    def column(label: str, key: str) -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
        return np.array([float(row[key] or "nan") for row in rows if row["gains"] == label])

    return {n: column(n, axis) for n in labels}, {n: {m: column(n, m) for m in metrics} for n in labels}


def _check_table(result: Json, check: Json) -> Table:
    sets: Mapping[str, Json] = check["sets"]
    columns = [
        Column("quantity", numeric=False),
        Column("unit", numeric=False),
        *(Column(name) for name in sets),
    ]
    columns.append(Column("limit", numeric=False))
    rows = [
        [
            text_cell("cost (equation 7)"),
            text_cell("1"),
            *(number_cell(s["cost"]) for s in sets.values()),
            text_cell(""),
        ]
    ]
    rows += term_rows(result, {name: s["worst"] for name, s in sets.items()}, sets)
    title = f"The sweep between the nodes: worst of {count(check['conditions'], 'condition')}"
    return Table(title, columns, rows, "Red: the limit is exceeded somewhere in the sweep.")
