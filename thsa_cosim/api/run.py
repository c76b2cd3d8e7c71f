"""Run a scenario and open what it leaves: each function is its command without the printing."""

from collections.abc import Sequence
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from thsa_cosim.api.conduct import ask, conduct
from thsa_cosim.api.kinds import DiagnoseStudy, IdentifyStudy, SimulateStudy, TuneStudy
from thsa_cosim.api.study import Study
from thsa_cosim.errors import InputError

if TYPE_CHECKING:
    from thsa_cosim.scenario import Source

Recordings = Path | str | Sequence[Path | str]
S = TypeVar("S", bound=Study)


def identify(
    scenario: "Source",
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
    """Identify parameters as ``scenario`` says: a TOML file (with or without stages), or its content as a dict.

    Parameters
    ----------
    folder
        Study folder; one that holds this study already is continued. Default ``studies/<scenario>-<date>``;
        of a dict the title takes the place of the scenario's name.
    fit, validate
        Recordings instead of the scenario's own: several, or one.
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
    return _conducted("identify", IdentifyStudy, scenario, quiet, _given(locals()))


def tune(
    scenario: "Source",
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
    return _conducted("tune", TuneStudy, scenario, quiet, _given(locals()))


def diagnose(
    scenario: "Source",
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
    """Find what the model of ``scenario`` lacks; arguments and errors as of :func:`identify`.

    A study that is complete is opened as it is.
    """
    return _conducted("diagnose", DiagnoseStudy, scenario, quiet, _given(locals()))


def simulate(
    scenario: "Source",
    *,
    folder: Path | str | None = None,
    fit: Recordings = (),
    validate: Recordings = (),
    seed: int | None = None,
    fmu: Path | str | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    quiet: bool = False,
) -> SimulateStudy:
    """Run ``scenario`` once per recording and compare; arguments and errors as of :func:`identify`.

    Parameters that the scenario would identify keep their start values.
    """
    return _conducted("simulate", SimulateStudy, scenario, quiet, _given(locals()))


def _given(arguments: dict[str, Any]) -> dict[str, Any]:
    """The arguments of a study as ``ask`` takes them; InputError for a number that is none."""
    given = {name: value for name, value in arguments.items() if name not in ("scenario", "quiet")}
    for role in ("fit", "validate"):
        if isinstance(given.get(role), Path | str):
            given[role] = (given[role],)
    for name, least in (("seed", 0), ("workers", 1)):
        value = given[name]
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
            raise InputError(f"{name} must be a whole number from {least} on, not {value!r}.")
        given[name] = int(value)
    return given


def _conducted(command: str, kind: type[S], scenario: "Source", quiet: bool, given: dict[str, Any]) -> S:
    study = conduct(ask(command, scenario, **given), quiet=quiet).open()
    assert isinstance(study, kind)
    return study
