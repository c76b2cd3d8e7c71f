"""The page of a comparison: what differs in a sentence, one picture of it, then the tables."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from thsa_cosim.report.compare.difference import NOTABLE_Z, Comparison, Row
from thsa_cosim.report.compare.tables import (
    TITLES,
    TREND_COLUMNS,
    shown,
    shown_difference,
    trend_cells,
)
from thsa_cosim.report.compare.watch import Trend, told
from thsa_cosim.report.page.write import Heading, render, write_html
from thsa_cosim.report.parts import chart
from thsa_cosim.report.parts.chart import Chart
from thsa_cosim.report.parts.content import Block, Cell, Column, Figure, Section, Table, Text
from thsa_cosim.report.parts.text import DASH, number, text_cell

COLUMNS = 3


def write_comparison(
    found: Comparison, target: Path, trends: Sequence[Trend] = (), sentence: str = ""
) -> Path:
    """Write the page of a comparison, with ``trends`` and their ``sentence`` if any, to ``target``; return it.

    InputError if it cannot be written.
    """
    title = " and ".join(found.labels) if len(found.labels) < 4 else f"{len(found.labels)} studies"
    own = [_trends(trends, sentence), *sections(found)] if trends else sections(found)
    write_html(target, render(Heading("compare", title, "complete"), own))
    return target


def _trends(trends: Sequence[Trend], sentence: str) -> Section:
    columns = [Column(text, numeric=False) for text in ("quantity", "at", "unit")]
    columns += [Column(text) for text in TREND_COLUMNS]
    rows = [[text_cell(c) for c in (t.name, t.at, t.unit, *trend_cells(t))] for t in trends]
    note = "Expected: what the earlier studies predict for the latest one, with the scatter between them."
    table = Table("Trends, the studies in the order of time", columns, rows, note)
    return Section("trends", "Trends", (Text(sentence or told(trends), "lead"), table))


def sections(found: Comparison) -> list[Section]:
    """The page's sections."""
    first: list[Block] = [Text(found.sentence(), "lead")]
    first += [figure for figure in (_parameters(found), _errors(found)) if figure is not None]
    shown_sections = [Section("summary", "What differs", (*first, *(Text(n) for n in found.notes)))]
    for group, title in TITLES.items():
        rows = [row for row in found.rows if row.group == group]
        if rows:
            shown_sections.append(Section(group, title, (_table(found, rows, group, title),)))
    if found.settings:
        columns = [
            Column("setting", numeric=False),
            *(Column(label, numeric=False) for label in found.labels),
        ]
        cells = [[text_cell(n), *(text_cell(v or DASH) for v in values)] for n, values in found.settings]
        table = Table("Asked or run differently", columns, cells)
        shown_sections.append(Section("settings", "Settings", (table,)))
    return shown_sections


def _table(found: Comparison, rows: list[Row], group: str, title: str) -> Table:
    with_z = group in ("parameter", "effect")
    columns = [Column(text, numeric=False) for text in ("quantity", "at", "unit")]
    columns += [Column(label) for label in found.labels]
    for label in found.labels[1:]:
        columns.append(Column(f"{label} − {found.labels[0]}"))
        columns += [Column("z")] if with_z else []
    cells = []
    for row in rows:
        line = [text_cell(row.name), text_cell(row.at), text_cell(row.unit)]
        line += [Cell(shown(v), None if v is None else v.value) for v in row.values]
        for difference in row.differences[1:]:
            line.append(Cell(shown_difference(difference), None if difference is None else difference.value))
            z = None if difference is None else difference.z
            if with_z:
                line.append(Cell(number(z, 2), z, "bad" if z is not None and abs(z) > NOTABLE_Z else ""))
        cells.append(line)
    note = f"z: the difference in its standard errors; red beyond ± {NOTABLE_Z:g}." if with_z else ""
    return Table(title, columns, cells, note)


def _parameters(found: Comparison) -> Figure | None:
    """Every parameter and effect in each study with its 95 % interval, one panel each, over the places."""
    rows = [row for row in found.rows if row.group in ("parameter", "effect") and row.same_unit]
    names = list(dict.fromkeys(row.name for row in rows))
    if not names:
        return None
    columns = min(COLUMNS, len(names))
    drawn = Chart("parameters", rows=-(-len(names) // columns), columns=columns, row_height=200)
    for k, name in enumerate(names):
        at, own = divmod(k, columns), [row for row in rows if row.name == name]
        places = [row.at or name for row in own]
        for j, label in enumerate(found.labels):
            values = [row.values[j] for row in own]
            known = [i for i, v in enumerate(values) if v is not None]
            if not known:
                continue
            x = np.array(known) + 0.16 * (j - 0.5 * (len(found.labels) - 1))
            y = [values[i].value for i in known]  # type: ignore[union-attr]
            bars = [1.96 * (values[i].stderr or 0.0) for i in known]  # type: ignore[union-attr]
            drawn.points(x, y, label, at=at, colour=chart.SERIES[j % 8], size=7, error=bars)
        ticks = {"tickvals": list(range(len(places))), "ticktext": [chart.plain(p) for p in places]}
        span = [-0.6, len(places) - 0.4]
        drawn.axes(*at, y=f"{name} [{own[0].unit}]", x_options={"tickmode": "array", **ticks, "range": span})
    return drawn.build(
        "Values with 95 % intervals; values whose intervals do not overlap differ significantly."
    )


def _errors(found: Comparison) -> Figure | None:
    """Every signal's rmse relative to the first study's."""
    rows = [
        row
        for row in found.rows
        if row.group == "error" and row.same_unit and row.values[0] is not None and row.values[0].value > 0.0
    ]
    if not rows:
        return None
    drawn = Chart("errors", row_height=240)
    labels = [f"{row.name}, {row.at}" for row in rows]
    first = [row.values[0].value for row in rows if row.values[0] is not None]
    for j, label in enumerate(found.labels):
        own = [row.values[j] for row in rows]
        heights = [None if v is None else v.value / base for v, base in zip(own, first, strict=True)]
        drawn.bars(labels, heights, label, colour=chart.SERIES[j % 8])
    drawn.level(1.0)
    drawn.axes(y=f"rmse / rmse of {found.labels[0]} [1]", x="signal and recordings [–]")
    return drawn.build(f"Errors relative to those of {found.labels[0]}; below the dotted line is better.")
