"""A scenario of whatever kind, from a file or from its content: the one way in."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, overload

from pydantic import ValidationError

from thsa_cosim.errors import InputError, ScenarioError, did_you_mean
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.scenario.model import Scenario
from thsa_cosim.scenario.recorded import resolve_recorded
from thsa_cosim.scenario.schema import KINDS, CommonTable, StagesTable
from thsa_cosim.scenario.sentences import from_validation, one_line
from thsa_cosim.scenario.source import Source, about_kind, read_source
from thsa_cosim.scenario.stages import Stage, StagedScenario
from thsa_cosim.scenario.tune_load import resolve_tune
from thsa_cosim.scenario.tune_model import TuneScenario
from thsa_cosim.scenario.tune_schema import TuneTable

AnyScenario = Scenario | StagedScenario | TuneScenario
S = TypeVar("S", Scenario, StagedScenario, TuneScenario)
Files = Sequence[Path | str]
Model = FmuDescription | Path | str | None

_TABLES: Mapping[str, type[CommonTable] | type[TuneTable]] = {**KINDS, "tune": TuneTable}


@overload
def load(
    source: Source,
    *,
    fit: Files = ...,
    validate: Files = ...,
    seed: int | None = ...,
    fmu: Model = ...,
) -> AnyScenario: ...
@overload
def load(
    source: Source,
    expected: type[S],
    *,
    fit: Files = ...,
    validate: Files = ...,
    seed: int | None = ...,
    fmu: Model = ...,
) -> S: ...
def load(
    source: Source,
    expected: type[S] | None = None,
    *,
    fit: Files = (),
    validate: Files = (),
    seed: int | None = None,
    fmu: Model = None,
) -> AnyScenario:
    """Read, check and resolve a scenario: one with recordings, a tuning, or several in stages.

    Parameters
    ----------
    source
        The TOML file, to which paths in it are relative; or its content (see ``Source``).
    expected
        The class that it must have; None: any.
    fit, validate
        Recordings (or globs, relative to the working directory) instead of the scenario's own.
    seed
        Replaces the scenario's seed.
    fmu
        An FMU, or its description, instead of the scenario's own.

    Raises
    ------
    ScenarioError
        For a key, value or reference that is wrong, and for what a scenario has no use for.
    FmuError, RecordingError, ParameterError, UnitError, MissingExtraError
        As the files that it names deserve. Every message is one line.
    """
    path, data = read_source(source)
    kind = _class_of(data)
    if expected is not None and kind is not expected:
        raise _unexpected(path, data)
    if kind is not StagedScenario:
        return _single(path, data, fit, validate, seed, fmu)
    if fit or validate or fmu:
        raise ScenarioError(
            f"{path}: has stages with recordings and FMUs of their own; replace them in the stages' files,"
            f" or run one stage alone."
        )
    return _staged(path, data, seed)


def _class_of(data: Mapping[str, Any]) -> type[AnyScenario]:
    if data.get("kind") == "tune":
        return TuneScenario
    return StagedScenario if "stages" in data else Scenario


def _unexpected(path: Path, data: Mapping[str, Any]) -> ScenarioError:
    if "stages" in data:
        return ScenarioError(one_line(f"{path} has stages itself; list those instead."))
    kind = data.get("kind")
    return ScenarioError(one_line(f"{path}: kind is {kind!r}: run 'thsa-cosim {kind} {path}'."))


def _single(
    path: Path, data: Mapping[str, Any], fit: Files, validate: Files, seed: int | None, fmu: Model
) -> Scenario | TuneScenario:
    """Resolve a scenario that has no stages; every message names its file."""
    kind = data.get("kind")
    for key in data:
        if kind != "tune" and (hint := did_you_mean(key, ["stages"])):
            raise ScenarioError(one_line(f"{path}: unknown key {key!r}.{hint}"))
    if not isinstance(kind, str) or kind not in _TABLES:
        what, hint = about_kind(data, _TABLES)
        supported = " or ".join(f'"{k}"' for k in _TABLES)
        raise ScenarioError(one_line(f"{path}: kind {what}; supported kinds are {supported}.{hint}"))
    if kind == "tune" and (fit or validate):
        raise ScenarioError(f"{path}: a tuning describes its command itself; leave out --fit and --validate.")
    try:
        table = _TABLES[kind].model_validate(data)
    except ValidationError as error:
        raise from_validation(path, data, error) from None
    try:
        if isinstance(table, TuneTable):
            return resolve_tune(path, table, seed, fmu)
        return resolve_recorded(path, table, fit, validate, seed, fmu)
    except InputError as error:
        message = str(error) if str(path) in str(error) else f"{path}: {error}"
        raise type(error)(one_line(message)) from None


def _staged(path: Path, data: Mapping[str, Any], seed: int | None) -> StagedScenario:
    """Load the scenarios that ``[[stages]]`` names; all of them are checked at once."""
    try:
        table = StagesTable.model_validate(data)
    except ValidationError as error:
        raise from_validation(path, data, error) from None
    if table.kind not in KINDS:
        raise ScenarioError(one_line(f"{path}: kind is {table.kind!r}.{did_you_mean(table.kind, KINDS)}"))
    stages = [_stage(path, k, table, seed) for k in range(len(table.stages))]
    names = [stage.name for stage in stages]
    if repeated := {name for name in names if names.count(name) > 1}:
        raise ScenarioError(one_line(f"{path}: stage {min(repeated)!r} appears twice; remove one."))
    return StagedScenario(table.kind, path, table.title, tuple(stages))


def _stage(path: Path, k: int, table: StagesTable, seed: int | None) -> Stage:
    spec = table.stages[k]
    file = path.parent / spec.scenario
    key = f"stages[{k + 1}]"
    try:
        scenario = load(file, Scenario, seed=table.seed if seed is None else seed)
    except InputError as error:
        raise type(error)(one_line(f"{path}: {key}: {error}")) from None
    if scenario.parameters.combinations:
        raise ScenarioError(
            one_line(f"{path}: {key}: {file.name} searches laws (temperature.group = 'law'), no stage.")
        )
    known = scenario.parameters.names
    for name in spec.give or ():
        if name not in known:
            raise ScenarioError(
                one_line(
                    f"{path}: {key}.give names {name!r}, which {file.name} does not find."
                    f"{did_you_mean(name, known)}"
                )
            )
    return Stage(file.stem, scenario, tuple(spec.give) if spec.give is not None else known)
