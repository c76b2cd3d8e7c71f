"""Run a scenario and open what it leaves: each function is its command without the printing."""

import datetime
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from thsa_cosim.api.kinds import DiagnoseStudy, IdentifyStudy, SimulateStudy, TuneStudy, open_study
from thsa_cosim.api.study import Study
from thsa_cosim.errors import ScenarioError

Recordings = Sequence[Path | str]
S = TypeVar("S", bound=Study)


def cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def default_folder(scenario: Path, suffix: str = "") -> Path:
    """``studies/<scenario>-<date>``: the same call on the same day continues the same study."""
    return Path("studies") / f"{scenario.stem}{suffix}-{datetime.date.today().isoformat()}"


def identify(
    scenario: Path | str,
    *,
    folder: Path | str | None = None,
    fit: Recordings = (),
    validate: Recordings = (),
    seed: int | None = None,
    fmu: Path | str | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    quiet: bool = False,
) -> IdentifyStudy:
    """Identify parameters as ``scenario`` (a TOML file, with or without stages) says.

    Parameters
    ----------
    folder
        Study folder; one that holds this study already is continued. Default ``studies/<scenario>-<date>``.
    fit, validate
        Recordings instead of the scenario's own.
    seed, fmu
        Instead of the scenario's own.
    workers, cluster
        Number of processes (default: all cores), or the address of a Dask scheduler.
    quiet
        Show no progress.

    Raises
    ------
    InputError
        If scenario, FMU, recordings or folder do not fit together; one sentence says why.
    StudyError
        If every simulation failed.
    """
    from thsa_cosim.identify import identify as run
    from thsa_cosim.report.identify.files import write_identify
    from thsa_cosim.report.progress import ProgressDisplay, console
    from thsa_cosim.report.staged import write_staged
    from thsa_cosim.scenario import Scenario, load_study
    from thsa_cosim.staged import run_stages

    path = Path(scenario)
    loaded = load_study(path, fit=fit, validate=validate, seed=seed, fmu=fmu)
    _check_kind(path, loaded.kind, "identify")
    place = Path(folder) if folder is not None else default_folder(path)
    processes = workers or cores()
    with ProgressDisplay(console(stderr=True), quiet=quiet) as display:
        if isinstance(loaded, Scenario):
            found = run(loaded, folder=place, workers=processes, cluster=cluster, on_progress=display)
            write_identify(found, place)
        else:
            staged = run_stages(loaded, folder=place, workers=processes, cluster=cluster, on_progress=display)
            write_staged(staged, place)
    return _opened(place, IdentifyStudy)


def tune(
    scenario: Path | str,
    *,
    folder: Path | str | None = None,
    seed: int | None = None,
    fmu: Path | str | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    quiet: bool = False,
) -> TuneStudy:
    """Tune gains as ``scenario`` says; arguments and errors as of :func:`identify`.

    Gains that break a hard requirement are a result as well: see ``feasible``.
    """
    from thsa_cosim.report.progress import ProgressDisplay, console
    from thsa_cosim.report.tune.files import write_tune
    from thsa_cosim.scenario import load_tune
    from thsa_cosim.tune import tune as run

    path = Path(scenario)
    loaded = load_tune(path, seed=seed, fmu=fmu)
    place = Path(folder) if folder is not None else default_folder(path)
    with ProgressDisplay(console(stderr=True), quiet=quiet) as display:
        found = run(loaded, folder=place, workers=workers or cores(), cluster=cluster, on_progress=display)
        write_tune(found, place)
    return _opened(place, TuneStudy)


def diagnose(
    scenario: Path | str,
    *,
    folder: Path | str | None = None,
    fit: Recordings = (),
    validate: Recordings = (),
    seed: int | None = None,
    fmu: Path | str | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    quiet: bool = False,
) -> DiagnoseStudy:
    """Find what the model of ``scenario`` lacks; arguments and errors as of :func:`identify`."""
    from thsa_cosim.diagnosis import diagnose as run
    from thsa_cosim.report.diagnose.result import write_diagnosis
    from thsa_cosim.report.progress import StepDisplay, console
    from thsa_cosim.scenario import load_scenario

    path = Path(scenario)
    loaded = load_scenario(path, fit=fit, validate=validate, seed=seed, fmu=fmu)
    _check_kind(path, loaded.kind, "diagnose")
    place = Path(folder) if folder is not None else default_folder(path)
    with StepDisplay(console(stderr=True), quiet=quiet) as display:
        found = run(loaded, folder=place, workers=workers or cores(), cluster=cluster, on_progress=display)
        write_diagnosis(found, place)
    return _opened(place, DiagnoseStudy)


def simulate(
    scenario: Path | str,
    *,
    folder: Path | str | None = None,
    fit: Recordings = (),
    validate: Recordings = (),
    fmu: Path | str | None = None,
    workers: int | None = None,
    cluster: str | None = None,
) -> SimulateStudy:
    """Run ``scenario`` once per recording and compare; arguments and errors as of :func:`identify`.

    Parameters that the scenario would identify keep their start values.
    """
    from thsa_cosim.report.simulate.files import write_simulate
    from thsa_cosim.scenario import load_scenario
    from thsa_cosim.simulate import simulate as run
    from thsa_cosim.study import open_study as claim_folder
    from thsa_cosim.study import study_identity

    path = Path(scenario)
    loaded = load_scenario(path, fit=fit, validate=validate, fmu=fmu)
    suffix = "" if loaded.kind == "simulate" else "-simulate"
    place = Path(folder) if folder is not None else default_folder(path, suffix)
    claim_folder(place, study_identity(loaded, "simulate"))
    write_simulate(run(loaded, folder=place, workers=workers or cores(), cluster=cluster), place)
    return _opened(place, SimulateStudy)


def _check_kind(path: Path, kind: str, wanted: str) -> None:
    if kind != wanted:
        raise ScenarioError(f"{path} is a scenario of kind {kind!r}: use {kind}({str(path)!r}).")


def _opened(folder: Path, kind: type[S]) -> S:
    study = open_study(folder)
    assert isinstance(study, kind)
    return study
