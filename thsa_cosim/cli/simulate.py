"""The command ``simulate``."""

import click

from thsa_cosim.cli.options import StudyOptions, console, study_options


@click.command()
@study_options
def simulate(options: StudyOptions) -> None:
    """Run SCENARIO once per recording and compare; parameters to be identified keep their start values."""
    from thsa_cosim.report.files import RESULT
    from thsa_cosim.report.progress import StepDisplay
    from thsa_cosim.report.simulate.files import write_simulate
    from thsa_cosim.report.simulate.tables import print_simulate
    from thsa_cosim.scenario import load_scenario
    from thsa_cosim.simulate import simulate as run
    from thsa_cosim.study import describe, open_study, study_identity

    loaded = load_scenario(options.scenario, **options.overrides)
    options.show_data(loaded)
    place = options.place("" if loaded.kind == "simulate" else "-simulate")
    folder = place["folder"]
    about = describe(loaded, options.repeat("simulate", folder))
    open_study(folder, study_identity(loaded, "simulate"), about)
    with StepDisplay(console(stderr=True), quiet=options.quiet) as display:
        result = run(loaded, **place, on_recording=lambda n, of: display(f"{n} of {of} recordings simulated"))
    files = [*write_simulate(result, folder), *options.page(folder)]
    options.conclude(folder / RESULT, len(files), lambda out: print_simulate(out, result))
