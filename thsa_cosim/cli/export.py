"""The command ``export``: a Modelica class as an FMU."""

import warnings
from collections.abc import Iterable
from pathlib import Path

import click

from thsa_cosim.cli.options import PATH
from thsa_cosim.shipped import modelica_package


@click.command(short_help="Export a Modelica class as an FMU.")
@click.argument("model", required=False)
@click.option(
    "--package",
    type=PATH,
    default=None,
    help="Folder of the class's Modelica package; default: modelica/THSA, or the shipped one.",
)
@click.option(
    "--library",
    "libraries",
    type=PATH,
    multiple=True,
    help="A Modelica library: a package's folder, a folder of packages or a .mo file; may be repeated. Those of the "
    "environment variable MODELICAPATH follow.",
)
@click.option(
    "--list", "listing", is_flag=True, help="List the models of the libraries (or of the package) instead."
)
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="FMI version.")
@click.option("-o", "--output", type=PATH, default=None, help="The FMU to write; default MODEL.fmu.")
@click.option(
    "--compiler",
    type=click.Choice(["native", "omc"]),
    default="native",
    show_default=True,
    help="Exporter: ours, or OpenModelica.",
)
@click.option(
    "--ssp",
    is_flag=True,
    help="MODEL is a scenario that describes a system of FMUs: write it as an SSP archive for other tools.",
)
@click.option("--platforms", default=None, help="Comma-separated FMI platforms, for example win64,linux64.")
def export(
    model: str | None,
    package: Path | None,
    libraries: tuple[Path, ...],
    listing: bool,
    fmi: str,
    output: Path | None,
    compiler: str,
    ssp: bool,
    platforms: str | None,
) -> None:
    """Export the Modelica class MODEL (or a .mo file's class) as an FMU."""

    from thsa_cosim.export import export_fmu, list_models

    if listing:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            _list(list_models(library) for library in libraries or (package or modelica_package(),))
        _note(said)
        return
    if model is None:
        raise click.UsageError(
            "MODEL is missing: a class name, or a .mo file; --list lists the models of a library."
        )
    if ssp:
        from thsa_cosim.scenario.archive import write_system

        click.echo(str(write_system(Path(model), output)))
        return
    chosen = None if platforms is None else [part.strip() for part in platforms.split(",") if part.strip()]
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        path = export_fmu(
            model,
            package=package,
            fmi=int(fmi),
            output=output,
            compiler=compiler,
            platforms=chosen,
            libraries=libraries,
        )
    _note(said)
    click.echo(str(path))


def _note(said: list[warnings.WarningMessage]) -> None:
    for warning in said:
        click.echo(f"note: {warning.message}", err=True)


def _list(found: Iterable[list[str]]) -> None:
    for names in found:
        for name in names:
            click.echo(name)
