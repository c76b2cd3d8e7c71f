"""The command ``export``: a Modelica class as an FMU."""

from pathlib import Path

import click

from thsa_cosim.cli.options import PATH


@click.command()
@click.argument("model")
@click.option(
    "--package",
    type=PATH,
    default=None,
    help="Folder of its package; default: modelica/THSA, or the shipped one.",
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
    model: str,
    package: Path | None,
    fmi: str,
    output: Path | None,
    compiler: str,
    ssp: bool,
    platforms: str | None,
) -> None:
    """Export the Modelica class MODEL (or a .mo file's class) as an FMU."""
    if ssp:
        from thsa_cosim.scenario.archive import write_system

        click.echo(str(write_system(Path(model), output)))
        return
    from thsa_cosim.export import export_fmu

    chosen = None if platforms is None else [part.strip() for part in platforms.split(",") if part.strip()]
    path = export_fmu(
        model, package=package, fmi=int(fmi), output=output, compiler=compiler, platforms=chosen
    )
    click.echo(str(path))
