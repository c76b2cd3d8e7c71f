"""What a diagnosis' residual is made of: which balance equation is at fault, and on what the residual depends."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from thsa_cosim.report.folder import Json, Part
from thsa_cosim.report.parts.chart import AFTER, BEFORE, RESIDUAL, Chart
from thsa_cosim.report.parts.content import Block, Cell, Column, Figure, Fold, Section, Table
from thsa_cosim.report.parts.text import count, number, number_cell, percent, plus_minus, text_cell
from thsa_cosim.signals import FloatArray

STRUCTURE = "structure.csv"
#: Panels side by side.
COLUMNS = 3


def attribution(part: Part) -> Section | None:
    """The residual by balance equation; None for a study that did not get so far."""
    balance: list[Json] = (part.result or {}).get("balance", [])
    if not balance:
        return None
    columns = [Column("balance equation", numeric=False), Column("unit", numeric=False), Column("rmse")]
    columns += [
        Column("noise"),
        Column("not noise, share of its residual"),
        Column("at fault", numeric=False),
    ]
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


def clearest(part: Part) -> Figure | None:
    """The one panel in which a residual depends most clearly on something; None without the table."""
    path = part.folder / STRUCTURE
    panels = _read(path) if path.is_file() else []
    if not panels:
        return None
    best = max(panels, key=lambda panel: panel.clarity)
    caption = (
        f"Mean residual of {best.channel} over {best.variable}, by the declared model (before) and with what was added"
        " (after)"
    )
    return _figure(f"{part.prefix}evidence", [best], height=340, what="residual of ", caption=caption)


def structure(part: Part) -> Section | None:
    """The mean residual over each variable that it may depend on, before and after; None without the table.

    Each channel's clearest dependence comes first; the others are under a fold per channel.
    """
    path = part.folder / STRUCTURE
    panels = _read(path) if path.is_file() else []
    if not panels:
        return None
    by_channel: dict[str, list[_Panel]] = {}
    for panel in sorted(panels, key=lambda panel: -panel.clarity):
        by_channel.setdefault(panel.channel, []).append(panel)
    clearest = [own[0] for own in by_channel.values()]
    blocks: list[Block] = [_figure(f"{part.prefix}dependence", clearest)]
    for k, (channel, own) in enumerate(by_channel.items()):
        figure = _figure(f"{part.prefix}dependence-{k}", own)
        blocks.append(
            Fold(
                f"Residual of {channel} over {count(len(own), 'variable')}, the clearest first",
                (figure,),
                details=True,
            )
        )
    law: Json | None = (part.result or {}).get("empirical")
    if law:
        blocks.append(_law_table(law))
    rivals: list[Json] = (part.result or {}).get("instead", [])
    if rivals:
        blocks.append(
            _rivals_table(rivals, "the effects" if (part.result or {}).get("effects") else "the law above")
        )
    return Section(f"{part.prefix}structure", "On what the residual depends", tuple(blocks))


_TERM_COLUMNS = (
    Column("slot", numeric=False),
    Column("term", numeric=False),
    Column("coefficient"),
    Column("unit", numeric=False),
)
_VARIABLES = "v, z, N, d: speed, position, load and distance in the slot, in its units"


def _term_cells(term: Json) -> tuple[Cell, ...]:
    return (
        text_cell(term["slot"]),
        text_cell(term["term"]),
        Cell(plus_minus(term["coefficient"], term.get("stderr")), term["coefficient"]),
        text_cell(term.get("unit", "")),
    )


def _rivals_table(rivals: list[Json], named: str) -> Table:
    columns = (Column("law"), *_TERM_COLUMNS)
    rows = [
        (Cell(str(k), k), *_term_cells(term))
        for k, law in enumerate(rivals, start=1)
        for term in law["terms"]
    ]
    note = f"{_VARIABLES}. Each law explains the held-out recordings as well as {named} would, alone."
    return Table(f"Empirical laws in place of {named} ± one standard error", columns, rows, note)


def _law_table(law: Json) -> Table:
    rows = [_term_cells(term) for term in law["terms"]]
    fate = (
        "added to the model"
        if law.get("added")
        else "not added to the model (diagnose.empirical = true adds it)"
    )
    note = (
        f"{_VARIABLES}; held-out gain {number(law.get('held_out_gain'), 3)} noise variances; {fate}. The law is"
        " descriptive, not physical."
    )
    return Table("Empirical law of the unexplained residual ± one standard error", _TERM_COLUMNS, rows, note)


def _shares(part: Part, balance: list[Json]) -> Figure:
    drawn = Chart(f"{part.prefix}balance", row_height=240)
    colours = [BEFORE if b.get("at_fault") else RESIDUAL for b in balance]
    drawn.bars(
        [b["equation"] for b in balance],
        [100.0 * (b.get("share") or 0.0) for b in balance],
        "",
        colour=colours,
    )
    drawn.axes(x="balance equation [–]", y="not noise, share of its residual [%]")
    return drawn.build(
        "Share of the residual of each balance that is not noise; the shares do not add up. Marked: balances that"
        " do not close."
    )


@dataclass(frozen=True, eq=False)
class _Panel:
    """Mean residual of a channel in bins (n,) of a variable, with one standard error."""

    variable: str
    unit: str
    channel: str
    channel_unit: str
    centre: FloatArray
    before: FloatArray
    after: FloatArray
    stderr: FloatArray

    @property
    def clarity(self) -> float:
        """How far the means are from zero, in standard errors (rms over the bins)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            far = np.array([self.before, self.after]) / self.stderr
        known = np.isfinite(far)
        rms = np.sqrt(np.sum(np.where(known, far, 0.0) ** 2, axis=1) / np.maximum(known.sum(axis=1), 1))
        return float(rms.max())


def _read(path: Path) -> list[_Panel]:
    rows: dict[tuple[str, str, str, str], list[list[float]]] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            key = row["variable"], row["unit"], row["channel"], row["channel_unit"]
            cells = (row[c] for c in ("bin_centre", "mean_before", "mean_after", "stderr"))
            rows.setdefault(key, []).append([float(cell) if cell else np.nan for cell in cells])
    return [_Panel(*key, *np.array(sorted(values), dtype=np.float64).T) for key, values in rows.items()]


def _figure(
    name: str,
    panels: list[_Panel],
    height: int = 210,
    what: str = "",
    caption: str = "Mean residual over possible causes",
) -> Figure:
    columns = min(COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    drawn = Chart(name, rows=rows, columns=columns, row_height=height)
    for k, panel in enumerate(panels):
        at = divmod(k, columns)
        for label, values, colour in (("before", panel.before, BEFORE), ("after", panel.after, AFTER)):
            error = 1.96 * panel.stderr
            if np.isfinite(values).any():
                drawn.points(
                    panel.centre, values, label, at=at, colour=colour, size=5, joined=True, error=error
                )
        drawn.level(0.0, at=at)
        drawn.axes(
            *at, x=f"{panel.variable} [{panel.unit}]", y=f"{what}{panel.channel} [{panel.channel_unit}]"
        )
    return drawn.build(f"{caption}, in bins, with 95 % intervals; 0 means nothing is left.")
