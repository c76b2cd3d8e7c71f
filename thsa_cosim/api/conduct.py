"""The table of kinds, and the one way to conduct a study of any of them: the command line and Python both come here.

A kind says which scenarios it takes, how it runs one, what it writes, how it prints it, and as what its folder opens
again; loading, the folder's name, progress and what is added to every ``result.json`` are the same for all.
"""

import contextlib
import datetime
import json
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from thsa_cosim.api.finished import Finished, finished, keep_finished
from thsa_cosim.api.kinds import DiagnoseStudy, IdentifyStudy, SimulateStudy, TuneStudy
from thsa_cosim.api.study import Study
from thsa_cosim.errors import MachineError, ScenarioError

if TYPE_CHECKING:
    from rich.console import Console

    from thsa_cosim.scenario import AnyScenario, Source
    from thsa_cosim.study import Place

RESULT = "result.json"
Recordings = Sequence[Path | str]


class Kind(Protocol):
    """One kind of study."""

    @property
    def name(self) -> str:
        """Of the command, and of the function."""

    @property
    def takes(self) -> tuple[str, ...]:
        """Kinds of scenarios that it runs."""

    @property
    def study(self) -> type[Study]:
        """What its folder opens as."""

    def run(self, scenario: Any, place: "Place") -> Any:
        """Run it; the result is an object of the kind's own."""

    def write(self, result: Any, folder: Path) -> list[Path]:
        """Write result.json and what goes with it; the files."""

    def show(self, out: "Console", result: Any, folder: Path) -> None:
        """Print tables of what was found."""

    def objection(self, result: Any, scenario: Any) -> str:
        """Why the result is of no use (exit code 3), or an empty string."""


class _Identify:
    name, takes, study = "identify", ("identify", "diagnose"), IdentifyStudy

    def run(self, scenario: Any, place: "Place") -> Any:
        from thsa_cosim.identify import identify
        from thsa_cosim.scenario import StagedScenario
        from thsa_cosim.staged import run_stages

        return (run_stages if isinstance(scenario, StagedScenario) else identify)(scenario, place)

    def write(self, result: Any, folder: Path) -> list[Path]:
        from thsa_cosim.report.identify.files import write_identify
        from thsa_cosim.report.staged import write_staged
        from thsa_cosim.staged import StagedResult

        return (write_staged if isinstance(result, StagedResult) else write_identify)(result, folder)

    def show(self, out: "Console", result: Any, folder: Path) -> None:
        from thsa_cosim.report.identify.tables import print_identify
        from thsa_cosim.report.staged import print_staged
        from thsa_cosim.staged import StagedResult

        (print_staged if isinstance(result, StagedResult) else print_identify)(out, result)

    def objection(self, result: Any, scenario: Any) -> str:
        return ""


class _Tune:
    name, takes, study = "tune", ("tune",), TuneStudy

    def run(self, scenario: Any, place: "Place") -> Any:
        from thsa_cosim.tune import tune

        return tune(scenario, place)

    def write(self, result: Any, folder: Path) -> list[Path]:
        from thsa_cosim.report.tune.files import write_tune

        return write_tune(result, folder)

    def show(self, out: "Console", result: Any, folder: Path) -> None:
        from thsa_cosim.report.tune.tables import print_tune

        print_tune(out, result)

    def objection(self, result: Any, scenario: Any) -> str:
        if result.after is not None and result.after.feasible:
            return ""
        return f"{scenario.path}: no gains within the bounds keep every hard requirement."


class _Simulate:
    name, takes, study = "simulate", ("simulate", "identify", "diagnose"), SimulateStudy

    def run(self, scenario: Any, place: "Place") -> Any:
        from thsa_cosim.simulate import simulate

        return simulate(scenario, place)

    def write(self, result: Any, folder: Path) -> list[Path]:
        from thsa_cosim.report.simulate.files import write_simulate

        return write_simulate(result, folder)

    def show(self, out: "Console", result: Any, folder: Path) -> None:
        from thsa_cosim.report.simulate.tables import print_simulate

        print_simulate(out, result)

    def objection(self, result: Any, scenario: Any) -> str:
        return ""


class _Diagnose:
    name, takes, study = "diagnose", ("diagnose",), DiagnoseStudy

    def run(self, scenario: Any, place: "Place") -> Any:
        from thsa_cosim.diagnosis import diagnose

        return diagnose(scenario, place)

    def write(self, result: Any, folder: Path) -> list[Path]:
        from thsa_cosim.report.diagnose.result import write_diagnosis

        write_diagnosis(result, folder)
        return [path for path in folder.rglob("*") if path.is_file()]

    def show(self, out: "Console", result: Any, folder: Path) -> None:
        from thsa_cosim.report.diagnose.tables import print_diagnosis

        print_diagnosis(out, read_result(folder) or {})

    def objection(self, result: Any, scenario: Any) -> str:
        return ""


KINDS: Mapping[str, Kind] = {kind.name: kind for kind in (_Identify(), _Tune(), _Simulate(), _Diagnose())}


@dataclass(frozen=True, eq=False)
class Asked:
    """A scenario that was loaded for a command, and where its study goes."""

    kind: Kind
    scenario: "AnyScenario"
    place: "Place"


@dataclass(frozen=True, eq=False)
class Conducted:
    """A study that was conducted; ``result`` is the kind's own, None of one that was found complete.

    ``kept``: what a study that was found complete printed when it ended; None of a diagnosis, which is shown from its
    result.json.
    """

    asked: Asked
    result: Any
    files: tuple[Path, ...]
    kept: Finished | None = None

    @property
    def folder(self) -> Path:
        """The study folder."""
        return self.asked.place.folder

    @property
    def status(self) -> str:
        """``complete`` or ``interrupted``."""
        return str(getattr(self.result, "status", "complete"))

    @property
    def objection(self) -> str:
        """Why the result is of no use, or an empty string."""
        if self.kept is not None:
            return self.kept.objection
        return "" if self.result is None else self.asked.kind.objection(self.result, self.asked.scenario)

    def show(self, out: "Console") -> None:
        """Print what was found."""
        if self.kept is not None:
            out.print(self.kept.printed, end="", highlight=False, markup=False, soft_wrap=True)
        else:
            self.asked.kind.show(out, self.result, self.folder)

    def open(self) -> Study:
        """The study as tables and figures."""
        return self.asked.kind.study(self.folder, read_result(self.folder) or {})


def ask(
    command: str,
    source: "Source",
    *,
    folder: Path | str | None = None,
    fit: Recordings = (),
    validate: Recordings = (),
    seed: int | None = None,
    fmu: Path | str | None = None,
    package: Path | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    repeat: Callable[[Path], str] | None = None,
) -> Asked:
    """Load a scenario for a command and say where its study goes; nothing is written yet.

    ``repeat``: from a folder to the command line that repeats the study. The others as in ``thsa_cosim.identify``;
    ``package`` is the Modelica package of a diagnosis instead of the scenario's own.

    Raises
    ------
    ScenarioError
        If the scenario is of a kind that the command does not run; the sentence names the command that does.
    """
    from thsa_cosim.scenario import Executor, Scenario, load
    from thsa_cosim.study import Place

    kind = KINDS[command]
    if isinstance(source, Mapping) and "kind" not in source:
        source = {"kind": command, **source}
    scenario = load(source, fit=fit, validate=validate, seed=seed, fmu=fmu)
    if scenario.kind not in kind.takes or (command != "identify" and hasattr(scenario, "stages")):
        raise ScenarioError(
            f"{scenario.path} is a scenario of kind {scenario.kind!r}:"
            f" run 'thsa-cosim {scenario.kind} {scenario.path}', or write one of kind {command!r}"
            + (" (thsa-cosim init --identify NAME)." if command == "identify" else ".")
        )
    if package is not None and isinstance(scenario, Scenario) and scenario.diagnose is not None:
        scenario = replace(scenario, diagnose=scenario.diagnose.model_copy(update={"package": package}))
    suffix = f"-{command}" if command == "simulate" and scenario.kind != "simulate" else ""
    name = scenario.path.stem if isinstance(source, Path | str) else _slug(scenario.title) or command
    place = Path(folder) if folder is not None else default_folder(Path(name), suffix)
    executor = Executor(workers or cores(), cluster)
    return Asked(kind, scenario, Place(place, executor, command="" if repeat is None else repeat(place)))


def conduct(asked: Asked, *, quiet: bool = False) -> Conducted:
    """Run the study, or find it complete; write its files.

    Raises
    ------
    InputError
        If the folder holds another study.
    StudyError, MachineError
        If every simulation failed, or the machine is at fault.
    """
    from thsa_cosim.report.progress import ProgressDisplay, console
    from thsa_cosim.study import shown_words

    kind, folder = asked.kind, asked.place.folder
    if not quiet:
        show_data(asked, console(stderr=True))
    if (found := _found_complete(asked)) is not None:
        if not quiet:
            sentence = f"{folder} holds this study, complete: it is shown again, and nothing is simulated."
            console(stderr=True).print(sentence, highlight=False, markup=False, soft_wrap=True)
        return found
    with _disk_of(folder), ProgressDisplay(console(stderr=True), quiet=quiet) as display:
        result = kind.run(asked.scenario, replace(asked.place, on_progress=display))
        done = Conducted(asked, result, tuple(kind.write(result, folder)))
        if kind.name != "diagnose" and done.status == "complete":
            keep_finished(folder, done.show, done.files, done.objection, shown_words(asked.scenario))
    return done


@contextlib.contextmanager
def _disk_of(folder: Path) -> Iterator[None]:
    """MachineError with the folder's name where the disk of a study refuses a file."""
    from thsa_cosim.fmu.machine import is_machines

    try:
        yield
    except OSError as error:
        if not is_machines(error):
            raise
        raise MachineError(
            f"The study folder {folder} cannot be written ({error.strerror}); repair that, or make room, and give the"
            " same command again."
        ) from None


def show_data(asked: Asked, out: "Console") -> None:
    """Print, one line each, what is wrong with the recordings, before anything is simulated."""
    from thsa_cosim.report.inspection import print_inspection
    from thsa_cosim.scenario import StagedScenario

    scenario = asked.scenario
    several = [s.scenario for s in scenario.stages] if isinstance(scenario, StagedScenario) else [scenario]
    for one in several:
        print_inspection(out, one.data, notes=False)


def read_result(folder: Path) -> dict[str, Any] | None:
    """The content of a folder's result.json, None if there is none or it is damaged."""
    try:
        content = json.loads((folder / RESULT).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None


def cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def default_folder(scenario: Path, suffix: str = "") -> Path:
    """``studies/<scenario>-<date>``: the same call on the same day continues the same study."""
    return Path("studies") / f"{scenario.stem}{suffix}-{datetime.date.today().isoformat()}"


def _slug(title: str) -> str:
    return re.sub(r"\W+", "-", title).strip("-").lower()[:40]


def _found_complete(asked: Asked) -> Conducted | None:
    """What the folder holds of this very study, if that is complete; InputError if it holds another one."""
    from thsa_cosim.report.files import write_json
    from thsa_cosim.scenario import StagedScenario
    from thsa_cosim.study import MARKER, claim_folder, shown_words, stages_identity, study_identity

    folder, scenario = asked.place.folder, asked.scenario
    content = read_result(folder)
    if content is None or content.get("status") != "complete" or not (folder / MARKER).is_file():
        return None
    if isinstance(scenario, StagedScenario):
        identity = stages_identity(scenario)
    else:
        identity = study_identity(scenario, asked.kind.name)
    claim_folder(folder, identity)
    if asked.kind.name != "diagnose":
        kept = finished(folder, shown_words(scenario))
        return None if kept is None else Conducted(asked, None, kept.files, kept)
    # All that is shown of a diagnosis is in its result; it takes too long to be run again for a title.
    title = scenario.title or scenario.path.stem
    if content.get("title", title) != title:
        write_json(folder / RESULT, {**content, "title": title})
    return Conducted(asked, None, tuple(path for path in folder.rglob("*") if path.is_file()))
