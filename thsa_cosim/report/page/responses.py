"""Responses of a tuning: command and velocity, error and effort, before and after, under every condition."""

from thsa_cosim.report.page import chart
from thsa_cosim.report.page.chart import Chart
from thsa_cosim.report.page.content import Block, Figure, Fold, Section
from thsa_cosim.report.page.folder import Part
from thsa_cosim.report.signal_files import SignalFile, read_signals, signal_paths

COMMAND = "command"


def responses(part: Part) -> Section | None:
    """The section; None before the responses were simulated."""
    found = [read_signals(path) for path in signal_paths(part.folder)]
    if not found:
        return None
    folds: list[Block] = []
    for k, one in enumerate(found):
        figure = _figure(f"{part.prefix}response-{k}", one)
        folds.append(Fold(one.name, (figure,), is_open=k in (0, len(found) - 1)))
    return Section(f"{part.prefix}responses", "Responses", tuple(folds))


def set_colour(name: str, rank: int) -> str:
    """The colour of a set of gains wherever it is drawn."""
    return {"before": chart.BEFORE, "after": chart.AFTER}.get(name, chart.SERIES[2 + rank % 6])


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
    for rank, variant in enumerate(sets):
        colour = set_colour(variant, rank)
        for row, channel in enumerate([main, main, *others]):
            values = found.channels[channel].get(variant)
            if values is None or (row == 1 and command is None):
                continue
            shown = command - values if row == 1 and command is not None else values
            drawn.line(found.time, shown, variant, at=(row, 0), colour=colour, width=1.5, thin=True)
    drawn.axes(0, 0, y=f"{main} [{found.units.get(main, '1')}]")
    drawn.axes(1, 0, y=f"error [{found.units.get(main, '1')}]")
    for row, channel in enumerate(others, start=2):
        drawn.axes(row, 0, y=f"{channel} [{found.units.get(channel, '1')}]")
    drawn.axes(rows - 1, 0, x="time [s]")
    return drawn.build(f"{found.name}: command and response, command − response, and what it takes.")
