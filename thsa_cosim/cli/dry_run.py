"""``--dry-run``: what a study would run and how long it would take, without a study folder."""

import json
from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from thsa_cosim.cli.options import StudyOptions, console

if TYPE_CHECKING:
    from thsa_cosim.api.conduct import Asked
    from thsa_cosim.api.forecast import Forecast

dry_run_option = click.option(
    "--dry-run",
    is_flag=True,
    help="Print what would run and how long it would take, after a few timed simulations.",
)


def show_forecast(options: StudyOptions, asked: "Asked") -> None:
    """Print the forecast of a scenario that was loaded, as tables or as JSON."""
    from thsa_cosim.api.forecast import forecast

    place = asked.place
    found = forecast(asked.scenario, place.executor)
    if options.as_json:
        content = {
            "folder": str(place.folder),
            "workers": place.executor.workers,
            "runs": sum(f.runs for f in found),
            "seconds": sum(f.seconds for f in found),
            "parts": [{**asdict(f), "runs": f.runs, "seconds": f.seconds} for f in found],
        }
        click.echo(json.dumps(content, indent=2))
        return
    _print(asked, found)


def _print(asked: "Asked", found: "tuple[Forecast, ...]") -> None:
    from rich.table import Table
    from rich.text import Text

    from thsa_cosim.report.progress import duration

    out = console()
    for part in found:
        table = Table(title=Text(part.title), title_justify="left")
        table.add_column("search")
        table.add_column("simulations of each vector", overflow="fold")
        table.add_column("vectors", justify="right")
        table.add_column("runs", justify="right")
        for search in part.searches:
            names = ", ".join(search.cases) if len(search.cases) <= 4 else f"{len(search.cases)}"
            table.add_row(Text(search.label), Text(names), str(search.vectors), str(search.runs))
        if part.also:
            table.add_row("besides", "comparisons", "", str(part.also))
        out.print(table)
        workers = "1 worker" if part.workers == 1 else f"{part.workers} workers"
        rate = f"{1.0 / part.run_s:.0f} runs/s" if part.run_s < 1.0 else f"{part.run_s:.1f} s a run"
        much = "about" if part.expected else "at most"
        more = "; more where local searches do not agree" if part.expected else ""
        out.print(
            f"{much} {part.runs} runs; {part.timed} timed: {rate} with {workers},"
            f" {much} {duration(part.seconds)}{more}",
            highlight=False,
        )
        for reason, count in part.failures.items():
            out.print(Text(f"{count} of the timed runs failed: {reason}"))
    if len(found) > 1:
        much = "about" if any(part.expected for part in found) else "at most"
        out.print(f"together {much} {duration(sum(part.seconds for part in found))}", highlight=False)
    folder = asked.place.folder
    what = "would be continued" if folder.exists() else "would be made"
    out.print(f"the study folder {folder} {what}; nothing was written", highlight=False, soft_wrap=True)
