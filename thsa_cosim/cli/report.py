"""The command ``report``: the page of a study."""

from pathlib import Path

import click

from thsa_cosim.cli.options import PATH


@click.command(short_help="Write the HTML page of a study, finished or running.")
@click.argument("folder", metavar="DIR", type=PATH)
@click.option("-o", "--output", type=PATH, default=None, help="The file to write; default DIR/report.html.")
@click.option("--open", "show", is_flag=True, help="Show the page in the browser.")
@click.option(
    "--live",
    is_flag=True,
    help="Write the page every 5 s while the study runs; the browser loads it by itself.",
)
def report(folder: Path, output: Path | None, show: bool, live: bool) -> None:
    """Write the HTML page of the study in DIR, finished or running: results, plots and provenance in one file."""
    from thsa_cosim.report.page import follow, write_page

    for number, page in enumerate(follow(folder, output) if live else (write_page(folder, output),)):
        if number == 0:
            click.echo(str(page))
            if show:
                click.launch(page.resolve().as_uri())
