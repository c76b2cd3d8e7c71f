"""What makes two runs the same study: everything that was asked, key by key.

The identity is built from the scenario's validated tables and from the contents of the files that they name, so a
key that is added to the schema is part of it without a line here. What is left out, and why, stands in
``SHOWN_ONLY`` and ``BY_CONTENT``.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim import __version__
from thsa_cosim.recordings import Recording
from thsa_cosim.scenario import AnyScenario, Scenario, StagedScenario, Table, TuneScenario
from thsa_cosim.scenario.table import FileTable
from thsa_cosim.study.digest import digest_of_file, digest_of_folder, digest_of_recording, digest_of_text

Identity = dict[str, Any]
"""What was asked: dotted key → plain JSON value; a key that is not given is not there."""

#: Keys that change nothing but words: the same study shows them as they now are.
SHOWN_ONLY = {
    "title": "shown in tables, plots and result.json, which are written anew",
    "parameters.description": "shown in tables",
}
#: Keys that name files: what is in the file counts, wherever it lies.
BY_CONTENT = {
    "kind": "the command counts: a diagnosis may be identified, any scenario be simulated",
    "seed": "--seed replaces it; the seed that is used counts",
    "fmu": "the digest of the archive",
    "components.fmu": "the digest of the system that is made of them",
    "recordings.fit": "digests of the samples that are used",
    "recordings.validate": "digests of the samples that are used",
    "profile.recordings": "digests of the samples that are used",
    "fixed.file": "the digest of the file",
    "parameter_set": "the start values that follow from it, per point",
    "uncertainty.result": "the covariances that were read from it",
    "diagnose.package": "the digest of the package's classes",
    "diagnose.catalogue": "the digest of the folder's effects",
    "stages.scenario": "the identity of the stage's scenario",
}
#: Packages whose version may change a study's numbers: random numbers, the search, the solver.
PACKAGES = ("fmpy", "numpy", "scipy")
#: Files that make a Modelica package.
MODELICA = ("*.mo", "package.order")


def study_identity(scenario: Scenario | TuneScenario, kind: str | None = None) -> Identity:
    """What is asked of ``scenario``, run as ``kind`` (its own unless another command runs it)."""
    wanted = kind or scenario.kind
    asked: Identity = {"kind": wanted, "seed": scenario.seed, "fmu": scenario.fmu.sha256}
    asked |= flatten(scenario.table) | _of_files(scenario)
    if isinstance(scenario, TuneScenario):
        asked |= {f"start values.{name}": value for name, value in scenario.fixed.items()}
        for profile in scenario.profiles:
            asked[f"profile.recordings[{profile.recording.name}]"] = digest_of_recording(profile.recording)
        if scenario.uncertainty is not None:
            read = (scenario.uncertainty.factors, scenario.uncertainty.points)
            asked["uncertainty.result"] = digest_of_text(repr(_plain(read)))
    else:
        asked |= _of_recordings(scenario)
    if wanted == "diagnose" and isinstance(scenario, Scenario) and scenario.diagnose is not None:
        spec = scenario.diagnose
        if spec.model is not None:
            asked["diagnose.package"] = digest_of_folder(spec.package, MODELICA)
            if spec.model.endswith(".mo"):
                asked["diagnose.model"] = digest_of_text(Path(spec.model).read_text(encoding="utf-8"))
        if spec.catalogue is not None:
            asked["diagnose.catalogue"] = digest_of_folder(spec.catalogue, ["*.py"])
    return asked | _versions()


def stages_identity(staged: StagedScenario) -> Identity:
    """What is asked of scenarios in stages: of each one, in order, and what it hands on."""
    asked: Identity = {"kind": f"{staged.kind} in stages", "stages (order)": [s.name for s in staged.stages]}
    for stage in staged.stages:
        own = study_identity(stage.scenario)
        asked |= {
            f"stages[{stage.name}].{key}": v for key, v in own.items() if not key.startswith("versions.")
        }
        asked[f"stages[{stage.name}].give"] = list(stage.give)
    return asked | _versions()


def shown_words(scenario: AnyScenario) -> Identity:
    """What ``scenario`` gives of ``SHOWN_ONLY``, key by key: the same study under other words is written anew."""
    if isinstance(scenario, StagedScenario):
        stages = {
            f"stages[{stage.name}].{key}": words
            for stage in scenario.stages
            for key, words in shown_words(stage.scenario).items()
        }
        return {"title": scenario.title, **stages}
    counted = flatten(scenario.table)
    return {key: words for key, words in flatten(scenario.table, BY_CONTENT).items() if key not in counted}


def flatten(table: Table, left_out: Collection[str] = (*SHOWN_ONLY, *BY_CONTENT)) -> Identity:
    """A validated table as dotted keys, as they stand in the file; defaults are filled in."""
    return dict(_flat(table, "", (), left_out))


def _flat(
    value: Any, key: str, path: tuple[str, ...], left_out: Collection[str]
) -> Iterable[tuple[str, Any]]:
    """``path``: names of the schema's keys alone, without those that a user chose (of a signal, say)."""
    if value is None or ".".join(path) in left_out:
        return
    if isinstance(value, Table):
        inside = [
            item
            for name, field in type(value).model_fields.items()
            for item in _flat(
                getattr(value, name), _join(key, field.alias or name), (*path, field.alias or name), left_out
            )
        ]
        yield from inside or [(key, {})]  # a table may mean something by being there
    elif isinstance(value, Mapping):
        members = [(f"{key}.{name}", name, member) for name, member in value.items()]
        yield from _members(key, path, members, left_out)
    elif isinstance(value, Sequence) and value and isinstance(value[0], Table):
        names = [str(getattr(member, "name", number)) for number, member in enumerate(value, start=1)]
        members = [(f"{key}[{name}]", name, member) for name, member in zip(names, value, strict=True)]
        yield from _members(key, path, members, left_out)
    else:
        yield key, _plain(value)


def _members(
    key: str, path: tuple[str, ...], members: Sequence[tuple[str, str, Any]], left_out: Collection[str]
) -> Iterable[tuple[str, Any]]:
    """Named members, and their order where there are several: terms, vectors and conditions follow it."""
    for own, _, member in members:
        yield from _flat(member, own, path, left_out)
    if len(members) > 1:
        yield f"{key} (order)", [name for _, name, _ in members]


def _join(*parts: str) -> str:
    return ".".join(part for part in parts if part)


def _of_files(scenario: Scenario | TuneScenario) -> Identity:
    """Files whose paths are start values."""
    home = scenario.path.parent
    files = {n: v.path(home) for n, v in scenario.table.fixed.items() if isinstance(v, FileTable)}
    return {f"fixed.{name}.file": digest_of_file(file) for name, file in files.items()}


def _of_recordings(scenario: Scenario) -> Identity:
    asked: Identity = {}
    roles: Mapping[str, Sequence[Recording]] = {"fit": scenario.fit, "validate": scenario.validate}
    for role, recordings in roles.items():
        for recording in recordings:
            asked[f"recordings.{role}[{recording.name}]"] = digest_of_recording(recording)
        asked[f"recordings.{role} (order)"] = [recording.name for recording in recordings]
    asked |= {f"start values.{name}": value for name, value in scenario.fixed.items()}
    for point in scenario.points:
        for name, value in point.fixed.items():
            if scenario.fixed.get(name) != value:  # what an earlier stage found
                asked[f"start values[{point.label}].{name}"] = value
    return asked


def _versions() -> Identity:
    found = {"thsa-cosim": __version__}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:  # a stripped installation
            continue
    return {f"versions.{name}": number for name, number in found.items()}


def _plain(value: Any) -> Any:
    """Dataclasses, arrays and paths as plain JSON values."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(name): _plain(member) for name, member in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(member) for member in value]
    return str(value) if isinstance(value, Path) else value
