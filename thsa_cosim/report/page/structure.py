"""What a diagnosis' residual is made of: which balance equation is at fault, and on what the residual depends."""

import csv
from pathlib import Path

import numpy as np

from thsa_cosim.report.page.chart import AFTER, BEFORE, RESIDUAL, Chart
from thsa_cosim.report.page.content import Block, Cell, Column, Figure, Section, Table
from thsa_cosim.report.page.folder import Json, Part
from thsa_cosim.report.page.text import number_cell, percent, text_cell
from thsa_cosim.report.signal_files import signal_units

STRUCTURE = "structure.csv"
#: Panels side by side.
COLUMNS = 3


def attribution(part: Part) -> Section | None:
    """The residual by balance equation; None for a study that did not get so far."""
    balance: list[Json] = (part.result or {}).get("balance", [])
    if not balance:
        return None
    columns = [Column("balance equation", numeric=False), Column("unit", numeric=False), Column("rmse")]
    columns += [Column("noise"), Column("share of the residual"), Column("at fault", numeric=False)]
    rows = [
        (
            text_cell(b["equation"]),
            text_cell(b.get("unit", "")),
            number_cell(b.get("rmse"), 3),
            number_cell(b.get("noise"), 3),
            Cell(percent(b.get("share"), 3), b.get("share")),
            text_cell("yes" if b.get("at_fault") else "no", "bad" if b.get("at_fault") else ""),
        )
        for b in balance
    ]
    blocks: tuple[Block, ...] = (
        _shares(part, balance),
        Table("The residual by balance equation", columns, rows),
    )
    return Section(f"{part.prefix}attribution", "Where the residual arises", blocks)


def structure(part: Part) -> Section | None:
    """The mean residual over each variable that it may depend on, before and after; None without the table."""
    path = part.folder / STRUCTURE
    if not path.is_file():
        return None
    panels = _read(path)
    if not panels:
        return None
    return Section(f"{part.prefix}structure", "On what the residual depends", (_figure(part, panels),))


def _shares(part: Part, balance: list[Json]) -> Figure:
    drawn = Chart(f"{part.prefix}balance", row_height=240)
    colours = [BEFORE if b.get("at_fault") else RESIDUAL for b in balance]
    drawn.bars(
        [b["equation"] for b in balance],
        [100.0 * (b.get("share") or 0.0) for b in balance],
        "",
        colour=colours,
    )
    drawn.axes(x="balance equation [–]", y="share of the residual [%]")
    return drawn.build("Share of the repeatable residual by balance equation; the one at fault is marked.")


Panel = dict[str, list[float]]


def _read(path: Path) -> dict[tuple[str, str, str, str], Panel]:
    """Columns by (variable, its unit, channel, the channel's unit)."""
    panels: dict[tuple[str, str, str, str], Panel] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            key = row["variable"], row["unit"], row["channel"], row.get("channel_unit") or ""
            panel = panels.setdefault(key, {"x": [], "before": [], "after": [], "stderr": []})
            panel["x"].append(_float(row["bin_centre"]))
            for name in ("before", "after"):
                panel[name].append(_float(row[f"mean_{name}"]))
            panel["stderr"].append(_float(row["stderr"]))
    return panels


def _float(text: str) -> float:
    return float(text) if text else float("nan")


def _figure(part: Part, panels: dict[tuple[str, str, str, str], Panel]) -> Figure:
    columns = min(COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    units = signal_units(part.folder)
    drawn = Chart(f"{part.prefix}dependence", rows=rows, columns=columns, row_height=210)
    for k, ((variable, unit, channel, channel_unit), panel) in enumerate(panels.items()):
        at = divmod(k, columns)
        order = np.argsort(panel["x"])
        x, error = np.array(panel["x"])[order], 1.96 * np.array(panel["stderr"])[order]
        for name, colour in (("before", BEFORE), ("after", AFTER)):
            y = np.array(panel[name])[order]
            if np.isfinite(y).any():
                drawn.points(x, y, name, at=at, colour=colour, size=5, joined=True, error=error)
        drawn.level(0.0, at=at)
        channel_unit = channel_unit or units.get(channel, "")
        residual = f"{channel} [{channel_unit}]" if channel_unit else channel
        drawn.axes(*at, x=f"{variable} [{unit or '1'}]", y=residual)
    return drawn.build(
        "Mean residual in bins of what it may depend on, with 95 % intervals; at 0 nothing is left."
    )
