"""What the command line prints at the end of a simulate study (rich)."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from thsa_cosim.report.parts.text import number, percent
from thsa_cosim.simulate import SimulateResult
from thsa_cosim.study import ChannelError


def print_simulate(console: Console, result: SimulateResult) -> None:
    """Print how well each recording is met, and why any of them could not be simulated."""
    table = Table(title="Simulated against measured", title_justify="left")
    for heading in ("recording", "signal"):
        table.add_column(heading)
    for heading in ("rmse", "noise", "rmse / noise", "rmse / range"):
        table.add_column(heading, justify="right")
    for recording in result.recordings:
        for name, error in recording.errors.items():
            table.add_row(Text(recording.name), Text(name), *error_cells(error))
    console.print(table)
    for recording in result.recordings:
        if recording.simulated is None:
            console.print(Text(f"{recording.name} failed: {recording.reason}"), highlight=False)
    for note in result.notes:
        console.print(Text(f"note: {note}"), highlight=False)


def error_cells(error: ChannelError) -> tuple[str, str, str, str]:
    """Rmse, noise, their ratio and the share of the range, as text."""
    unit = f" {error.unit}"
    ratio = error.rmse / error.noise if error.noise > 0.0 else None
    return (
        number(error.rmse, 3) + unit,
        number(error.noise, 3) + unit,
        number(ratio, 3),
        percent(error.nrmse),
    )
