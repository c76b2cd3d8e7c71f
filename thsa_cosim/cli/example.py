"""The command ``example``: a shipped scenario with its data, to run and to change."""

from pathlib import Path

import click

from thsa_cosim.cli.options import PATH, console


@click.command(short_help="Copy a shipped scenario with its data.")
@click.argument("name", required=False)
@click.option("-o", "--output", type=PATH, default=Path(), help="Folder to copy into; default: this one.")
def example(name: str | None, output: Path) -> None:
    """Copy the shipped scenario NAME with its FMU, recordings and Modelica package; without NAME, list all.

    A file that exists with other content is never overwritten.
    """
    from thsa_cosim.shipped import copy_example, examples

    known = examples()
    if name is None:
        _list()
        return
    files = copy_example(name, output)
    click.echo(f"{len(files)} files in {output.resolve()}")
    if missing := known[name].missing:
        click.echo(f"not shipped: {', '.join(missing)}; docs/{name}.md says where to get it")
    click.echo(f"\nthsa-cosim {known[name].kind} {files[0]}")


def _list() -> None:
    from rich.table import Table
    from rich.text import Text

    from thsa_cosim.shipped import examples

    table = Table(title="Shipped scenarios", title_justify="left")
    for heading in ("name", "command", "what it does"):
        table.add_column(heading, overflow="fold")
    for one in examples().values():
        table.add_row(one.name, one.kind, Text(one.title))
    console().print(table)
    click.echo("thsa-cosim example NAME copies one into this folder.")
