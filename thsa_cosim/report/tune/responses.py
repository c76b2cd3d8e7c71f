"""Responses of a tuning: command and velocity, error and effort, before and after, under every condition."""

from collections.abc import Iterable

from thsa_cosim.report.folder import Part
from thsa_cosim.report.parts import chart
from thsa_cosim.report.parts.chart import Chart
from thsa_cosim.report.parts.content import Block, Figure, Fold, Section
from thsa_cosim.report.signal_files import SignalFile, file_name, read_signals, signal_paths

COMMAND = "command"


def responses(part: Part) -> Section | None:
    """The section; None before the responses were simulated."""
    found = [read_signals(path) for path in signal_paths(part.folder)]
    if len(found) < 2:
        return None
    folds: list[Block] = []
    for k, one in list(enumerate(found))[1:]:  # the summary shows the first
        figure = _figure(f"{part.prefix}response-{file_name(one.name)}", one)
        folds.append(Fold(one.name, (figure,), is_open=k in (0, len(found) - 1)))
    return Section(f"{part.prefix}responses", "Responses", tuple(folds))


def first_response(part: Part) -> Figure | None:
    """The response under the first condition; None before the responses were simulated."""
    paths = signal_paths(part.folder)
    if not paths:
        return None
    first = read_signals(paths[0])
    return _figure(f"{part.prefix}response-{file_name(first.name)}", first)


def set_colours(names: Iterable[str]) -> dict[str, str]:
    """The colour of every set of gains, the same wherever it is drawn."""
    fixed = {COMMAND: chart.MEASURED, "before": chart.BEFORE, "after": chart.AFTER}
    fixed |= {"schedule": chart.AFTER, "best single set": chart.SERIES[3]}
    others = [name for name in names if name not in fixed]
    free = (chart.SERIES[2], *chart.SERIES[4:])
    return fixed | {name: free[k % len(free)] for k, name in enumerate(others)}


def _figure(name: str, found: SignalFile) -> Figure:
    main = next(
        (c for c, variants in found.channels.items() if COMMAND in variants), next(iter(found.channels))
    )
    others = [c for c in found.channels if c != main]
    rows = 2 + len(others)
    drawn = Chart(
        name, rows=rows, row_height=140, weights=[1.7, 1.0, *[1.0] * len(others)], shared_x=True, between=16
    )
    command = found.channels[main].get(COMMAND)
    sets = [v for v in found.channels[main] if v != COMMAND]
    if command is not None:
        drawn.line(found.time, command, COMMAND, colour=chart.MEASURED, dash="dash", width=1.5)
    colours = set_colours(sets)
    for variant in sets:
        for row, channel in enumerate([main, main, *others]):
            values = found.channels[channel].get(variant)
            if values is None or (row == 1 and command is None):
                continue
            shown = command - values if row == 1 and command is not None else values
            drawn.line(found.time, shown, variant, at=(row, 0), colour=colours[variant], width=1.5, thin=True)
    drawn.axes(0, 0, y=f"{main} [{found.units.get(main, '1')}]")
    drawn.axes(1, 0, y=f"error [{found.units.get(main, '1')}]")
    for row, channel in enumerate(others, start=2):
        drawn.axes(row, 0, y=f"{channel} [{found.units.get(channel, '1')}]")
    drawn.axes(rows - 1, 0, x="time [s]")
    below = ", tracking error, and control effort" if others else " and, below, tracking error"
    return drawn.build(f"{found.name}: command, response{below}.")
