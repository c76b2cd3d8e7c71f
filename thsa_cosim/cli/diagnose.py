"""The command ``diagnose``."""

import click

from thsa_cosim.cli.options import StudyOptions, console, study_options


@click.command()
@study_options
def diagnose(options: StudyOptions) -> None:
    """Find what the model of SCENARIO lacks: trace the residual to an effect, add it, report held-out errors."""
    from thsa_cosim.diagnosis import diagnose as run
    from thsa_cosim.report.diagnosis_json import write_diagnosis
    from thsa_cosim.report.diagnosis_tables import print_diagnosis
    from thsa_cosim.report.progress import StepDisplay
    from thsa_cosim.report.study import RESULT
    from thsa_cosim.scenario import load_scenario

    loaded = load_scenario(options.scenario, **options.overrides)
    options.check_kind(loaded.kind, "diagnose")
    place = options.place()
    folder = place["folder"]
    with StepDisplay(console(stderr=True), quiet=options.quiet) as display:
        result = run(loaded, **place, on_progress=display, command=options.repeat("diagnose", folder))
    files = [*write_diagnosis(result, folder), *options.page(folder)]
    options.conclude(folder / RESULT, len(files), lambda out: print_diagnosis(out, result))
