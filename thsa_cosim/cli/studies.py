"""The commands about several studies: ``list`` and ``compare``."""

import json
from dataclasses import asdict
from pathlib import Path

import click

from thsa_cosim.cli.options import PATH, console


@click.command(name="list", short_help="List the studies in a folder, the latest first.")
@click.argument("folder", type=PATH, required=False)
@click.option("--json", "as_json", is_flag=True, help="Print the studies as JSON.")
def list_command(folder: Path | None, as_json: bool) -> None:
    """List the studies in FOLDER and below, the latest first; default: studies, or this folder."""
    from thsa_cosim.report.compare import list_studies
    from thsa_cosim.report.compare.tables import print_list

    place = folder or (Path("studies") if Path("studies").is_dir() else Path())
    found = list_studies(place)
    if as_json:
        entries = [{**asdict(entry), "folder": str(entry.folder)} for entry in found]
        click.echo(json.dumps(entries, indent=2))
    elif found:
        print_list(console(), found)
    else:
        click.echo(f"No study in {place} or below; name the folder that holds your studies.")


@click.command(short_help="Compare studies: parameters, effects, errors.")
@click.argument("folders", metavar="A B ...", type=PATH, nargs=-1, required=True)
@click.option("-o", "--output", type=PATH, default=None, help="Also write the comparison as an HTML page.")
@click.option("--json", "as_json", is_flag=True, help="Print the comparison as JSON.")
@click.option(
    "--watch",
    "watched",
    is_flag=True,
    help="The studies are of one unit, in the order of time: trends, and an alarm that is false once a year."
    " Studies in several folders are several units.",
)
def compare(folders: tuple[Path, ...], output: Path | None, as_json: bool, watched: bool) -> None:
    """Compare study folders with the first one: parameters, effects, errors and settings that differ.

    Each difference is given with its standard error and with z, the difference divided by that error. With --watch,
    each quantity of the latest studies is compared with what the earlier ones predict, and its trend is tested; several
    units are compared with each other, too.
    """
    from thsa_cosim.report.compare import compare as compared
    from thsa_cosim.report.compare.fleet import units_of, watch_fleet
    from thsa_cosim.report.compare.page import write_comparison
    from thsa_cosim.report.compare.tables import print_comparison, print_trends
    from thsa_cosim.report.compare.watch import watch

    units, sentence, more = units_of(folders), "", {}
    if watched and len(units) > 1:
        fleet = watch_fleet(units)
        found, trends, sentence = fleet.latest, fleet.trends, fleet.sentence()
        more = {"odd": [asdict(one) for one in fleet.odd]}
    else:
        found = compared(folders)
        trends = watch(found) if watched else ()
    if output is not None:
        write_comparison(found, output, trends, sentence)
        click.echo(f"page: {output}", err=True)
    if as_json:
        own = {"trends": [{**asdict(t), "alarm": t.alarm} for t in trends], **more} if watched else {}
        click.echo(json.dumps(found.to_dict() | own, indent=2))
    elif watched:
        print_trends(console(), trends, sentence)
    else:
        print_comparison(console(), found)
