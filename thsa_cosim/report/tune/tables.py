"""What the command line prints at the end of a tuning (rich)."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from thsa_cosim.report.parts.text import number
from thsa_cosim.report.tune.result import start_rows, term_units
from thsa_cosim.tune import ScheduleCheck, Scored, TuneResult


def print_tune(console: Console, result: TuneResult) -> None:
    """Print gains and terms before and after, the line, and the schedule with its check."""
    sets = [s for s in (result.before, *result.compare, result.after) if s is not None]
    if sets:
        many = len(result.conditions) > 1
        where = f"worst of {len(result.conditions)} simulations" if many else result.groups[0].label
        title = f"{result.scenario.title} ({where})" if many else result.scenario.title
        console.print(_sets_table(title, sets, result))
    if result.scenario.profiles:
        names = [f"{k} = {p.recording.name}" for k, p in enumerate(result.scenario.profiles, 1)]
        console.print(Text(f"profiles: {', '.join(names)}"), highlight=False)
    if result.line is not None:
        line = result.line
        beside = "" if line.published is None else f"; published {number(line.published)}"
        console.print(
            f"{line.numerator}/{line.denominator} over the last {line.generations} generations:"
            f" {number(line.ratio)} ({number(line.low)} to {number(line.high)}){beside}",
            highlight=False,
            soft_wrap=True,
        )
    if result.scenario.start is not None and result.after is not None:
        console.print(_start_table(result))
    if result.schedule is not None:
        console.print(_schedule_table(result))
        if result.schedule.check is not None:
            console.print(_check_table(result, result.schedule.check))
    for text in result.notes:
        console.print(Text(f"note: {text}"), highlight=False)


def _sets_table(title: str, sets: list[Scored], result: TuneResult) -> Table:
    table = Table(title=title, title_justify="left")
    table.add_column("term")
    for scored in sets:
        table.add_column(Text(scored.name), justify="right")
    table.add_column("limit", justify="right")
    space = result.scenario.parameters
    for parameter in space.parameters:
        cells = ["varies" if s.name == "schedule" else number(s.gains[parameter.name]) for s in sets]
        table.add_row(Text(f"{parameter.name} [{parameter.unit}]"), *cells, "")
    table.add_row("cost (equation 7)", *(number(s.eq7) for s in sets), "", style="bold")
    units = term_units(result)
    limits = {r.name: ("≤ " if r.upper else "≥ ") + number(r.limit) for r in result.scenario.requirements}
    for name in result.terms:
        cells = [number(s.worst[name]) + ("" if s.excess.get(name, 0.0) <= 0.0 else " !") for s in sets]
        table.add_row(Text(f"{name} [{units[name]}]"), *cells, limits.get(name, ""))
    if any(not s.feasible for s in sets):
        table.caption = "!: beyond the limit"
        table.caption_justify = "left"
    return table


def _start_table(result: TuneResult) -> Table:
    rows = [row for row in start_rows(result) if row["gains"] == "after"]
    units = term_units(result)
    table = Table(title="Start from rest after a soak, with the tuned gains", title_justify="left")
    for name in list(rows[0])[1:]:
        unit = units.get(name)
        table.add_column(Text(name if unit in (None, "1") else f"{name} [{unit}]"), justify="right")
    for row in rows:
        table.add_row(*(number(value, 3) for value in list(row.values())[1:]))
    return table


def _schedule_table(result: TuneResult) -> Table:
    assert result.schedule is not None
    schedule = result.schedule.schedule
    table = Table(title="Schedule (linear between nodes)", title_justify="left")
    for name, unit in zip(schedule.names, schedule.units, strict=True):
        table.add_column(Text(f"{name} [{unit}]"), justify="right")
    for name in schedule.gains:
        table.add_column(Text(f"{name} [{schedule.gain_units[name]}]"), justify="right")
    for row in schedule.points():
        table.add_row(*(number(v) for v in row.values()))
    return table


def _check_table(result: TuneResult, check: ScheduleCheck) -> Table:
    title = f"Sweep between the nodes: worst of {len(check.conditions)} conditions"
    return _sets_table(title, list(check.sets), result)
