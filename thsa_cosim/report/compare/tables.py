"""What ``thsa-cosim list`` and ``thsa-cosim compare`` print (rich)."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from thsa_cosim.report.compare.difference import NOTABLE_Z, Comparison, Difference, Estimate
from thsa_cosim.report.compare.listing import Entry
from thsa_cosim.report.compare.watch import Trend, told
from thsa_cosim.report.parts.text import DASH, number, plus_minus

TITLES = {
    "parameter": "Parameters ± one standard error",
    "effect": "Effects ± one standard error",
    "result": "Results",
    "error": "Errors (rmse)",
}


def print_list(console: Console, entries: Sequence[Entry]) -> None:
    """Print one line per study."""
    table = Table()
    for heading in ("study", "kind", "status", "started (UTC)", "scenario", "outcome"):
        table.add_column(heading, overflow="fold")
    for one in entries:
        day = one.started.replace("T", " ")[:16]
        cells = (str(one.folder), one.kind, one.status, day, one.scenario, one.outcome or one.problem)
        table.add_row(*map(Text, cells))
    console.print(table)


def print_comparison(console: Console, found: Comparison) -> None:
    """Print what differs, a table per group of quantities, the settings, and the notes."""
    console.print(Text(found.sentence(), style="bold"), highlight=False)
    for group, title in TITLES.items():
        if any(row.group == group for row in found.rows):
            console.print(_quantities(found, group, title))
    if found.settings:
        console.print(_settings(found))
    for note in found.notes:
        console.print(Text(f"note: {note}"), highlight=False)


def print_trends(console: Console, trends: Sequence[Trend], sentence: str = "") -> None:
    """Print the alarms in a sentence (default: those of the trends) and the trend of every quantity."""
    console.print(Text(sentence or told(trends), style="bold"), highlight=False)
    table = Table(title="Trends, the studies in the order of time", title_justify="left")
    table.add_column("quantity", overflow="fold")
    table.add_column("at")
    table.add_column("unit")
    for heading in TREND_COLUMNS:
        table.add_column(heading, justify="right")
    for t in trends:
        cells = (t.name, t.at, t.unit, *trend_cells(t))
        table.add_row(*(Text(cell, style="bold red" if t.alarm else "") for cell in cells))
    console.print(table)


TREND_COLUMNS = ("latest", "expected", "t", "slope per study", "t", "alarm")


def trend_cells(t: Trend) -> tuple[str, ...]:
    """What `TREND_COLUMNS` name, as text."""
    return (
        number(t.latest, 4),
        plus_minus(t.expected, t.scatter),
        number(t.single, 2),
        plus_minus(t.slope, t.slope_stderr),
        number(t.drift, 2),
        t.alarm or ("one study" if t.is_suspect else DASH),
    )


def _quantities(found: Comparison, group: str, title: str) -> Table:
    table = Table(title=title, title_justify="left")
    for heading in ("quantity", "at", "unit"):
        table.add_column(heading, overflow="fold")
    for label in found.labels:
        table.add_column(Text(label), justify="right")
    for label in found.labels[1:]:
        table.add_column(Text(f"{label} − {found.labels[0]}"), justify="right")
        if group in ("parameter", "effect"):
            table.add_column("z", justify="right")
    for row in (r for r in found.rows if r.group == group):
        cells = [Text(row.name), Text(row.at), Text(row.unit), *(Text(shown(v)) for v in row.values)]
        for difference in row.differences[1:]:
            cells.append(Text(shown_difference(difference)))
            if group in ("parameter", "effect"):
                cells.append(z_text(difference))
        table.add_row(*cells)
    return table


def shown(value: Estimate | None) -> str:
    """``0.498 ± 0.002``, in brackets where the data do not determine it."""
    if value is None:
        return DASH
    text = plus_minus(value.value, value.stderr)
    return text if value.determined else f"({text})"


def shown_difference(difference: Difference | None) -> str:
    """The difference with its standard error."""
    return DASH if difference is None else plus_minus(difference.value, difference.stderr)


def z_text(difference: Difference | None) -> Text:
    """The difference in standard errors; marked beyond chance."""
    z = None if difference is None else difference.z
    return Text(number(z, 2), style="bold red" if z is not None and abs(z) > NOTABLE_Z else "")


def _settings(found: Comparison) -> Table:
    table = Table(title="Asked or run differently", title_justify="left")
    for heading in ("setting", *found.labels):
        table.add_column(Text(heading), overflow="fold")
    for name, values in found.settings:
        table.add_row(Text(name), *(Text(value or DASH) for value in values))
    return table
