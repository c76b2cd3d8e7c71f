"""The command ``init``: a first scenario for an FMU and a recording."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from thsa_cosim.cli.options import PATH, console
from thsa_cosim.errors import InputError

if TYPE_CHECKING:
    from thsa_cosim.draft import Draft


@click.command(short_help="Write a first scenario for an FMU and recordings.")
@click.argument("files", metavar="[FMU] [RECORDING]...", type=PATH, nargs=-1)
@click.option("--fmu", type=PATH, help="The FMU (or SSP archive) to simulate; or give it as an argument.")
@click.option(
    "--recording",
    "recordings",
    type=PATH,
    multiple=True,
    help="A file of measured signals, or give it as an argument; may be repeated.",
)
@click.option(
    "-o",
    "--output",
    type=PATH,
    default=Path("scenario.toml"),
    show_default=True,
    help="The scenario to write.",
)
@click.option(
    "--identify",
    multiple=True,
    metavar="NAME[=LOWER:UPPER]",
    help="A parameter of the FMU to identify, with its bounds in the FMU's unit (default: a fifth and five times its"
    " start value); may be repeated.",
)
def init(
    files: tuple[Path, ...],
    fmu: Path | None,
    recordings: tuple[Path, ...],
    output: Path,
    identify: tuple[str, ...],
) -> None:
    """Write a commented scenario that drives an FMU with a recording and compares, or identifies parameters.

    Columns are matched to the FMU's inputs and outputs by name, description and unit; columns without a
    match are listed in the file. The scenario runs as it is. An HTML page next to it shows the recordings as the
    scenario reads them, with the findings of the data check.
    """
    from thsa_cosim.draft import draft_scenario
    from thsa_cosim.report.inspection import print_inspection
    from thsa_cosim.report.preview import write_preview
    from thsa_cosim.scenario import Scenario, load
    from thsa_cosim.system import read_description

    fmu, recordings = _sorted(files, fmu, recordings)
    if output.exists():
        raise InputError(f"{output} exists already; choose another file with -o.")
    draft = draft_scenario(read_description(fmu), recordings, output, identify)
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(draft.text, encoding="utf-8")
    _print(draft)
    try:
        scenario = load(output, Scenario)
    except InputError as error:
        raise InputError(
            f"{output} was written, but does not load yet; correct it by hand: {error}"
        ) from None
    print_inspection(console(), scenario.data, remedies=True)
    preview = write_preview(scenario, draft, output.with_suffix(".html"))
    click.echo(f"\nThe recordings as the scenario reads them: {preview}")
    if draft.undriven:
        names = ", ".join(variable.name for variable in draft.undriven)
        remedy = f"name the column under [recordings.columns.{draft.undriven[0].name}] unless it is constant."
        if not draft.is_driven:
            click.echo(f"{output} is not ready: nothing drives {names}, so the model stays at rest; {remedy}")
            return
        click.echo(f"No column that changes drives {names}; {remedy}")
    if identify:
        click.echo(
            f"{output} is ready: thsa-cosim check {output} --sensitivity, then thsa-cosim identify {output}"
        )
        return
    click.echo(f"{output} is ready: thsa-cosim simulate {output}")


def _sorted(
    files: tuple[Path, ...], fmu: Path | None, recordings: tuple[Path, ...]
) -> tuple[Path, tuple[Path, ...]]:
    """The FMU and the recordings, from arguments and options."""
    models = [path for path in files if path.suffix.lower() in (".fmu", ".ssp")]
    models += [fmu] if fmu is not None else []
    recordings = (*recordings, *(path for path in files if path not in models))
    if len(models) != 1:
        given = f"{len(models)} were given ({', '.join(map(str, models))})" if models else "none was given"
        raise InputError(f"init takes one FMU, and {given}: thsa-cosim init MODEL.fmu RECORDING.csv.")
    if not recordings:
        raise InputError(f"no recording was given: thsa-cosim init {models[0]} RECORDING.csv.")
    return models[0], recordings


def _print(draft: "Draft") -> None:
    from rich.table import Table
    from rich.text import Text

    table = Table(title="Columns of the recording as variables of the FMU", title_justify="left")
    for heading in ("variable", "role", "column", "unit", "matched"):
        table.add_column(heading, overflow="fold")
    for match in draft.matches:
        role = "input" if match.variable.causality == "input" else "output"
        cells = (match.variable.name, role, match.column.name, match.column.unit or "not stated", match.why)
        table.add_row(*(Text(cell) for cell in cells))
    for variable in draft.constant:
        value = f"constant {variable.start or 0.0:g}"
        table.add_row(Text(variable.name), "input", "–", Text(variable.unit or ""), value)
    for variable in draft.unmatched_outputs:
        table.add_row(Text(variable.name), "output", "–", Text(variable.unit or ""), "not compared")
    out = console()
    out.print(table)
    for name, reason in draft.unused.items():
        out.print(Text(f"column {name!r} is not used: it {reason}"))
    if draft.unmatched_columns:
        names = ", ".join(column.name for column in draft.unmatched_columns)
        out.print(Text(f"columns without a match: {names}"))
