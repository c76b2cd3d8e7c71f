"""The command ``report``: the page of a study."""

from pathlib import Path

import click

from thsa_cosim.cli.options import PATH


@click.command()
@click.argument("folder", metavar="DIR", type=PATH)
@click.option("-o", "--output", type=PATH, default=None, help="The file to write; default DIR/report.html.")
@click.option("--open", "show", is_flag=True, help="Show the page in the browser.")
def report(folder: Path, output: Path | None, show: bool) -> None:
    """Write the HTML page of the study in DIR, finished or running: results, plots and provenance in one file."""
    from thsa_cosim.report.page import write_page

    page = write_page(folder, output)
    click.echo(str(page))
    if show:
        click.launch(page.resolve().as_uri())
