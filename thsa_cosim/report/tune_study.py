"""All files of a tuning in its study folder, and what the command line prints."""

from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from thsa_cosim.report.result_json import write_json
from thsa_cosim.report.schedule_files import write_schedule
from thsa_cosim.report.signal_files import write_signals
from thsa_cosim.report.study import RESULT
from thsa_cosim.report.tables import number
from thsa_cosim.report.tune_json import term_units, tune_to_dict, write_check_csv, write_pareto_csv
from thsa_cosim.signals import Signals
from thsa_cosim.tune import ScheduleCheck, Scored, TuneResult


def write_tune(result: TuneResult, folder: Path, on_file: Callable[[Path], None] | None = None) -> list[Path]:
    """Write result.json, tables, schedule and plots; return what was written, in order."""
    # matplotlib takes half a second to import: not before the study has run.
    from thsa_cosim.report import tune_plots

    written: list[Path] = []

    def note(path: Path) -> None:
        written.append(path)
        if on_file is not None:
            on_file(path)

    write_json(folder / RESULT, tune_to_dict(result))
    note(folder / RESULT)
    plots = folder / "plots"
    for path in write_responses(result, folder):
        note(path)
    if result.after is not None:
        tune_plots.plot_responses(result, plots / "responses.png")
        note(plots / "responses.png")
    if result.groups:
        tune_plots.plot_convergence(result.groups, plots / "convergence.png")
        note(plots / "convergence.png")
    if result.surface is not None:
        tune_plots.plot_surface(result.surface, result, plots / "surface.png")
        note(plots / "surface.png")
    if result.pareto is not None and result.pareto.x.size:
        write_pareto_csv(folder / "pareto.csv", result, result.pareto)
        note(folder / "pareto.csv")
        tune_plots.plot_pareto(result.pareto, result, plots / "pareto.png")
        note(plots / "pareto.png")
    if result.schedule is not None:
        for path in write_schedule(folder, result.schedule.schedule, result.scenario.title):
            note(path)
        tune_plots.plot_schedule(result.schedule, result, plots / "schedule.png")
        note(plots / "schedule.png")
        if result.schedule.check is not None:
            write_check_csv(folder / "schedule_check.csv", result, result.schedule)
            note(folder / "schedule_check.csv")
            if result.scenario.requirements:
                tune_plots.plot_check(result.schedule, result, plots / "schedule_check.png")
                note(plots / "schedule_check.png")
    return written


def write_responses(result: TuneResult, folder: Path) -> list[Path]:
    """Write command and responses under every condition: the commanded output in the cost's unit, others in theirs."""
    scenario = result.scenario
    command, unit = scenario.command, scenario.cost.unit
    others = [n for n in (scenario.metrics.effort, *(r.signal for r in scenario.requirements)) if n]
    units = {axis.name: axis.unit for axis in scenario.axes}
    written: dict[str, Path] = {}
    for k, condition in enumerate(result.conditions):
        label = ", ".join(f"{n} = {v:g} {units[n]}" for n, v in condition.items()) or "response"
        if label in written:  # the same condition with a sample of uncertain parameters
            continue
        variants = {
            "command": Signals(
                command.time, {command.output: command.values / scenario.cost.scale}, {command.output: unit}
            )
        }
        for scored in (result.before, *result.compare, result.after):
            signals = None if scored is None or k >= len(scored.signals) else scored.signals[k]
            if scored is not None and signals is not None:
                shown = signals.select(
                    [command.output, *dict.fromkeys(n for n in others if n != command.output)]
                )
                response = shown[command.output] * command.factor / scenario.cost.scale
                variants[scored.name] = shown.with_values({command.output: response}, {command.output: unit})
        written[label] = write_signals(folder, "response", label, variants)
    return list(written.values())


def print_tune(console: Console, result: TuneResult) -> None:
    """Print gains and terms before and after, the line, and the schedule with its check."""
    sets = [s for s in (result.before, *result.compare, result.after) if s is not None]
    if sets:
        many = len(result.conditions) > 1
        where = f"worst of {len(result.conditions)} simulations" if many else result.groups[0].label
        title = f"{result.scenario.title} ({where})" if many else result.scenario.title
        console.print(_sets_table(title, sets, result))
    if result.line is not None:
        line = result.line
        beside = "" if line.published is None else f"; published {number(line.published)}"
        console.print(
            f"{line.numerator}/{line.denominator} over the last {line.generations} generations:"
            f" {number(line.ratio)} ({number(line.low)} to {number(line.high)}){beside}",
            highlight=False,
            soft_wrap=True,
        )
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
