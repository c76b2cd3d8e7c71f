"""The search: cost against step or generation with the population's spread, and how each search ended."""

import numpy as np

from thsa_cosim.report.folder import Json, Part
from thsa_cosim.report.parts import chart
from thsa_cosim.report.parts.chart import Chart
from thsa_cosim.report.parts.content import Block, Column, Figure, Section, Table
from thsa_cosim.report.parts.populations import Evolution, evolutions
from thsa_cosim.report.parts.text import number_cell, search_label, text_cell
from thsa_cosim.signals import FloatArray
from thsa_cosim.tune.combine import INFEASIBLE

#: Panels side by side.
COLUMNS = 4


def part_evolutions(part: Part) -> list[Evolution]:
    """The populations of all searches of a part, as far as they are known."""
    if part.journal is None:
        return []
    ends = _ends(part)
    if ends and not any(end["generations"] for end in ends):
        return []  # local searches agreed, and no evolution ran
    used = {end["label"]: max(end["generations"] - 1, 0) for end in ends}
    limit = INFEASIBLE if part.kind == "tune" else float("inf")
    return evolutions(part.journal, part.population, part.generations, used, limit)


def convergence(part: Part) -> Section | None:
    """The section; None for a study without a search."""
    found = part_evolutions(part)
    blocks: list[Block] = []
    local = [p for p in (part.result or {}).get("points", []) if p.get("local")]
    if local:
        blocks.append(_local_figure(part, local))
    if found:
        blocks.append(_figure(part, found, "evolution" if local else "convergence"))
    ends = _ends(part)
    if ends:
        blocks.append(_ends_table(part, ends))
    elif found:
        blocks.append(_so_far_table(part, found))
    return Section(f"{part.prefix}search", "Search", tuple(blocks)) if blocks else None


def _ends(part: Part) -> list[Json]:
    """How each search of a finished part ended: label, generations, cost, evaluations, why it stopped."""
    result = part.result or {}
    ends: list[Json] = [
        {
            "label": point["label"],
            "generations": len(point["generations"]),
            "cost": point["cost_per_sample"],
            "evaluations": point["evaluations"],
            "stopped": point["stopped"],
            "polish": point["polish"],
        }
        for point in result.get("points", [])
        if "generations" in point
    ]
    ends += [
        {
            "label": group["label"],
            "generations": len(group["best_cost"]),
            "cost": group["cost"],
            "evaluations": None,
            "stopped": group["stopped"],
            "polish": "",
        }
        for group in result.get("groups", [])
    ]
    return ends


def _scales(part: Part) -> dict[str, float]:
    """What turns a search's cost into what is drawn: per sample for an identification."""
    points = (part.result or {}).get("points", [])
    scales = {p["label"]: p["cost_per_sample"] / p["cost"] for p in points if p.get("cost")}
    samples: Json = part.about.get("samples", {})
    return {**{label: 1.0 / n for label, n in samples.items() if n}, **scales}


def _local_figure(part: Part, points: list[Json]) -> Figure:
    """Cost after each step of every local search, one panel per point."""
    columns = min(COLUMNS, len(points))
    rows = -(-len(points) // columns)
    drawn = Chart(
        f"{part.prefix}convergence", rows=rows, columns=columns, row_height=230 if rows > 1 else 290
    )
    for k, point in enumerate(points):
        at = divmod(k, columns)
        scale = point["cost_per_sample"] / point["cost"] if point["cost"] else 1.0
        for search in point["local"]:
            cost = [value * scale for value in search["cost"]]
            name, colour = ("agrees", chart.SIMULATED) if search["agrees"] else ("another end", chart.INK)
            drawn.line(list(range(len(cost))), cost, name, at=at, colour=colour, width=1.2)
        drawn.title(search_label(point["label"]), *at)
        drawn.axes(
            *at,
            x="step [1]" if k + columns >= len(points) else "",
            y="cost per sample [1]" if at[1] == 0 else "",
            log_y=True,
            dtick_y=1,
            x_options={"rangemode": "tozero"},
        )
    return drawn.build(
        "Cost (equation 6) per sample, 1 = only noise is left, along local searches from different starts."
    )


def _figure(part: Part, found: list[Evolution], name: str) -> Figure:
    columns = min(COLUMNS, len(found))
    rows = -(-len(found) // columns)
    drawn = Chart(f"{part.prefix}{name}", rows=rows, columns=columns, row_height=230 if rows > 1 else 290)
    scales = _scales(part)
    for k, evolution in enumerate(found):
        at = divmod(k, columns)
        low, lower, middle, upper, high = evolution.quantiles * scales.get(evolution.label, 1.0)
        generation = list(range(low.size))
        drawn.band(generation, low, high, "all vectors", at=at, colour="var(--band-faint)")
        drawn.band(generation, lower, upper, "middle half", at=at)
        drawn.line(generation, middle, "median", at=at, colour=chart.INK, width=1.2, dash="dot")
        drawn.line(generation, low, "best", at=at, colour=chart.SIMULATED, width=2)
        drawn.title(search_label(evolution.label), *at)
        last_row, first_column = k + columns >= len(found), at[1] == 0
        drawn.axes(
            *at,
            x="generation [1]" if last_row else "",
            y=("cost [1]" if part.kind == "tune" else "cost per sample [1]") if first_column else "",
            log_y=True,
            # Labels between the powers of ten clutter a panel that spans several of them.
            dtick_y=1 if _spans_decades(low, high) else None,
            x_options={"dtick": max(1, -(-len(generation) // 6)), "rangemode": "tozero"},
        )
    what = "Cost (equation 7 with requirements; infeasible vectors are left out)"
    if part.kind != "tune":
        what = "Cost (equation 6) per sample, 1 = only noise is left; before the polish"
    return drawn.build(f"{what}, against generation, over the population of {part.population} vectors.")


def _spans_decades(low: FloatArray, high: FloatArray) -> bool:
    """Whether finite costs from ``low`` to ``high`` differ thirtyfold; a search that found none has only NaN."""
    found = np.isfinite(low) & np.isfinite(high)
    return bool(found.any() and np.max(high[found]) > 30.0 * np.min(low[found]))


def _ends_table(part: Part, ends: list[Json]) -> Table:
    columns = [Column("search", numeric=False), Column("generations"), Column(_cost_heading(part))]
    if part.kind != "tune":
        columns += [Column("evaluations"), Column("polish ended because", numeric=False)]
    columns.append(Column("search ended because", numeric=False))
    rows = []
    for end in ends:
        row = [
            text_cell(search_label(end["label"])),
            number_cell(end["generations"] - 1) if end["generations"] else text_cell("–"),
            number_cell(end["cost"]),
        ]
        if part.kind != "tune":
            row += [number_cell(end["evaluations"], 6), text_cell(end["polish"] or "no polish")]
        rows.append((*row, text_cell(end["stopped"])))
    return Table("How the searches ended", columns, rows)


def _so_far_table(part: Part, found: list[Evolution]) -> Table:
    columns = (
        Column("search", numeric=False),
        Column("generation"),
        Column("of"),
        Column(_cost_heading(part)),
    )
    scales = _scales(part)
    rows = []
    for evolution in found:
        best = float(evolution.quantiles[0, -1]) * scales.get(evolution.label, 1.0)
        numbers = (len(evolution.costs) - 1, part.generations, best)
        rows.append((text_cell(search_label(evolution.label)), *map(number_cell, numbers)))
    return Table("How far the searches are", columns, rows)


def _cost_heading(part: Part) -> str:
    return "best cost" if part.kind == "tune" else "cost per sample"
