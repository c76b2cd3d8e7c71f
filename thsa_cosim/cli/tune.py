"""The command ``tune``."""

import click

from thsa_cosim.cli.dry_run import dry_run_option, show_forecast
from thsa_cosim.cli.options import Interrupted, StudyOptions, console, study_options
from thsa_cosim.errors import InputError, StudyError


@click.command()
@study_options
@dry_run_option
def tune(options: StudyOptions, dry_run: bool) -> None:
    """Tune gains for the commands and conditions that SCENARIO describes; schedule them if it asks."""
    from thsa_cosim.report.files import RESULT
    from thsa_cosim.report.progress import ProgressDisplay
    from thsa_cosim.report.tune.files import write_tune
    from thsa_cosim.report.tune.tables import print_tune
    from thsa_cosim.scenario import load_tune
    from thsa_cosim.tune import tune as run

    if options.fit or options.validate:
        raise InputError(
            f"{options.scenario}: a tuning describes its command itself; leave out --fit and --validate."
        )
    loaded = load_tune(options.scenario, seed=options.seed, fmu=options.fmu)
    if dry_run:
        show_forecast(options, loaded)
        return
    place = options.place()
    folder = place["folder"]
    repeat = options.repeat("tune", folder)
    with ProgressDisplay(console(stderr=True), quiet=options.quiet) as display:
        result = run(loaded, **place, on_progress=display, command=repeat)
        files = [*write_tune(result, folder), *options.page(folder)]
    if result.status == "interrupted":
        raise Interrupted(repeat)
    options.conclude(folder / RESULT, len(files), lambda out: print_tune(out, result))
    if result.after is None or not result.after.feasible:
        raise StudyError(f"{options.scenario}: no gains within the bounds keep every hard requirement.")
