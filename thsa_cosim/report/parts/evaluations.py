"""What was evaluated: cost over evaluations, the best vector of each search, parallel coordinates, importances.

Told from the journal alone: it works while the search runs.
"""

import numpy as np

from thsa_cosim.batch import JournalRow, Status
from thsa_cosim.report.folder import Part
from thsa_cosim.report.parts import chart
from thsa_cosim.report.parts.chart import Chart
from thsa_cosim.report.parts.content import Block, Column, Figure, Fold, Section, Table, Text
from thsa_cosim.report.parts.importance import importances
from thsa_cosim.report.parts.text import number, number_cell, search_label, text_cell
from thsa_cosim.signals import FloatArray
from thsa_cosim.tune.combine import INFEASIBLE

#: Vectors that parallel coordinates show of a search: the best, and others drawn evenly from the rest.
SHOWN = 200
#: Shares of the feasible vectors, best first, with their names and colours.
_GROUPS = (
    (0.5, "other half", "var(--rule)"),
    (0.1, "better half", chart.MEASURED),
    (0.0, "best tenth", chart.SIMULATED),
)


def evaluated(part: Part) -> Section | None:
    """The section; None where a study kept no vectors."""
    searches = _searches(part)
    if not searches:
        return None
    names = part.journal.names if part.journal else ()
    blocks: list[Block] = [_costs(part, searches), _best_table(part, names, searches)]
    several = len(names) > 1
    drawn = [
        _coordinates(part, names, label, *_numbers(part, rows)) for label, rows in searches.items() if several
    ]
    figures = [figure for figure in drawn if figure is not None]
    blocks += figures[:1]
    blocks += _importance(part, names, searches) if several else []
    if len(figures) > 1:
        blocks.append(Fold("Vectors of the other searches", figures[1:]))
    return Section(f"{part.prefix}evaluations", "Evaluations", tuple(blocks))


def _searches(part: Part) -> dict[str, list[JournalRow]]:
    found: dict[str, list[JournalRow]] = {}
    for row in part.journal.rows if part.journal else ():
        found.setdefault(row.stage, []).append(row)
    return found


def _numbers(part: Part, rows: list[JournalRow]) -> tuple[FloatArray, FloatArray]:
    """Vectors (n, p) and costs (n,) that are feasible, in the order of their evaluation."""
    limit = INFEASIBLE if part.kind == "tune" else float("inf")
    good = [row for row in rows if row.status == Status.OK and np.isfinite(row.cost) and row.cost < limit]
    return np.array([row.values for row in good]), np.array([row.cost for row in good], dtype=np.float64)


def _costs(part: Part, searches: dict[str, list[JournalRow]]) -> Figure:
    """Each evaluation's cost, and the best so far: of all searches in one panel, as shares of each one's best."""
    drawn = Chart(f"{part.prefix}costs", row_height=280)
    for label, rows in list(searches.items())[: len(chart.SERIES)]:
        limit = INFEASIBLE if part.kind == "tune" else float("inf")
        costs = np.array(
            [row.cost if row.status == Status.OK and row.cost < limit else np.inf for row in rows]
        )
        best = np.minimum.accumulate(costs)
        last = best[-1] if np.isfinite(best[-1]) and best[-1] > 0.0 else 1.0
        colour = chart.SERIES[list(searches).index(label)]
        at = np.arange(1, len(rows) + 1)
        if len(searches) == 1:
            drawn.points(at, costs / last, "evaluation", colour="var(--band)", size=4, edge=0)
        drawn.line(at, best / last, search_label(label), colour=colour, width=2)
    drawn.axes(x="evaluation [1]", y="cost / best cost [1]", log_y=True, x_options={"rangemode": "tozero"})
    return drawn.build(
        "Best cost so far over the evaluations of each search; 1 is the best that it has found."
    )


def _best_table(part: Part, names: tuple[str, ...], searches: dict[str, list[JournalRow]]) -> Table:
    units = part.about.get("parameters", {})
    units = units if isinstance(units, dict) else {}
    columns = [Column("search", numeric=False), *(Column(name, str(units.get(name, ""))) for name in names)]
    columns += [Column("cost"), Column("evaluations"), Column("since the best"), Column("failed")]
    rows = []
    for label, evaluations in searches.items():
        vectors, costs = _numbers(part, evaluations)
        k = int(np.argmin(costs)) if costs.size else -1
        values = vectors[k] if costs.size else np.full(len(names), np.nan)
        best = costs[k] if costs.size else float("nan")
        since = next((n for n, row in enumerate(reversed(evaluations)) if row.cost == best), len(evaluations))
        broken = sum(row.status != Status.OK for row in evaluations)
        row = [text_cell(search_label(label)), *map(number_cell, values), number_cell(best)]
        rows.append((*row, *(number_cell(n, 8) for n in (len(evaluations), since, broken))))
    return Table("Best vector of each search" + (" so far" if part.result is None else ""), columns, rows)


def _coordinates(
    part: Part, names: tuple[str, ...], label: str, vectors: FloatArray, costs: FloatArray
) -> Figure | None:
    """One line a vector, from axis to axis; each axis from the least to the largest value that was tried."""
    if costs.size < 3:
        return None
    order = np.argsort(costs)
    rest = order[np.unique(np.linspace(0, costs.size - 1, min(SHOWN, costs.size)).astype(int))]
    rank = np.argsort(order) / costs.size
    columns = np.column_stack([vectors, costs / costs[order[0]]])
    scaled, ends = zip(*(_axis(column) for column in columns.T), strict=True)
    heights = np.column_stack([*scaled, np.full(costs.size, np.nan)])[rest]
    drawn = Chart(f"{part.prefix}coordinates-{list(_searches(part)).index(label)}", row_height=300)
    across = np.arange(columns.shape[1] + 1, dtype=np.float64)
    upper = 1.1
    for least, name, colour in _GROUPS:
        inside = (rank[rest] >= least) & (rank[rest] < upper)
        upper = least
        if inside.any():
            lines = heights[inside]
            skip = {"hoverinfo": "skip"}
            drawn.line(np.tile(across, len(lines)), lines.ravel(), name, colour=colour, width=1.0, extra=skip)
    best = order[0]
    texts = [f"{name} = {number(value)}" for name, value in zip((*names, "cost"), columns[best], strict=True)]
    drawn.points(
        across[:-1],
        heights[0, :-1],
        "best",
        colour=chart.PUBLISHED,
        joined=True,
        size=6,
        labels=texts,
        extra={"hovertemplate": "%{text}<extra></extra>"},
    )
    ticks = [
        f"{chart.plain(name)}<br>{_short(high)}<br>{_short(low)}"
        for name, (low, high) in zip((*names, "cost"), ends, strict=True)
    ]
    axis = {
        "tickvals": across[:-1].tolist(),
        "ticktext": ticks,
        "range": [-0.4, across[-2] + 0.4],
        "tickangle": 0,
    }
    drawn.axes(x="", y="", x_options=axis, y_options={"showticklabels": False, "range": [-0.04, 1.04]})
    shown = "every feasible vector" if costs.size <= SHOWN else f"{SHOWN} of {costs.size} feasible vectors"
    return drawn.build(
        f"Parallel coordinates of {search_label(label)}: {shown}. Below each axis stand the highest and the lowest"
        " value that were tried; the cost is a multiple of the best. An axis that spans a factor of 30 is logarithmic."
    )


def _short(value: float) -> str:
    """Two digits; 5 axes have to fit on a telephone."""
    return number(value, 2).replace("e+0", "e").replace("e-0", "e-")


def _axis(values: FloatArray) -> tuple[FloatArray, tuple[float, float]]:
    """Values (n,) from 0 to 1, and what these two stand for."""
    low, high = float(values.min()), float(values.max())
    if not high > low:
        return np.full(values.size, 0.5), (low, high)
    if low > 0.0 and high > 30.0 * low:
        return np.log(values / low) / np.log(high / low), (low, high)
    return (values - low) / (high - low), (low, high)


def _importance(part: Part, names: tuple[str, ...], searches: dict[str, list[JournalRow]]) -> list[Block]:
    found = {label: importances(*_numbers(part, rows)) for label, rows in searches.items()}
    known = {label: it for label, it in found.items() if it is not None}
    if 2 * len(known) < len(found):
        text = (
            "No importances: a quadratic model of the cost does not describe what was evaluated well enough."
        )
        return [Text(text)] if part.result is not None else []
    shares = np.array([it.shares for it in known.values()])
    drawn = Chart(f"{part.prefix}importance", row_height=220)
    order = np.argsort(-np.median(shares, axis=0))
    drawn.bars(
        [names[k] for k in order], np.median(shares, axis=0)[order].tolist(), "", colour=chart.SERIES[0]
    )
    drawn.axes(x="", y="importance [1]", y_range=(0.0, 1.0))
    least = min(it.explained for it in known.values())
    of = "" if len(found) == 1 else f" (median of {len(known)} searches of {len(found)})"
    return [
        drawn.build(
            f"Importance of each parameter for the cost{of}: what a quadratic model of its logarithm, fitted to the"
            " evaluated vectors, loses without the parameter, as a share of all. On vectors that were left out of its"
            f" fit the model explains at least {100.0 * least:.0f}\u00a0% of the variance."
        )
    ]
