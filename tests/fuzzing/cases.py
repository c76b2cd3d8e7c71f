"""One case: a folder with mutated input and the command line to run there, drawn from ``(kind, seed, index)``."""

import json
import shutil
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from random import Random

import pandas as pd
from small_scenario import toml

from fuzzing import archives, recordings, scenarios
from fuzzing.material import SCENARIOS, samples
from fuzzing.raw import mutate_bytes, mutate_text

DIAGNOSIS = "diagnosis.toml"
"""Takes so long that it has a kind of its own."""
COMMANDS = {
    "motor.toml": "identify",
    "check.toml": "simulate",
    "stages.toml": "identify",
    "tuning.toml": "tune",
}
STUDY = "study"
"""The only folder that a command may write to, in the folder of its case."""
FINISHED = "finished"
"""Folder of the material with a finished study of every scenario."""


@dataclass(frozen=True)
class Case:
    """What to run: ``arguments`` of the command line, in ``folder``."""

    name: str
    folder: Path
    arguments: tuple[str, ...]

    @property
    def writes_result(self) -> bool:
        """Whether a success leaves a result.json in the study folder."""
        return self.arguments[0] not in ("check", "report")


def healthy_cases(kinds: Collection[str], material: Path, base: Path) -> list[Case]:
    """Make the commands that are mutated, each with healthy input: all must succeed."""
    if kinds == ("diagnosis",):
        return [_case("healthy-diagnosis", base, material, "diagnose", DIAGNOSIS)]
    commands = {**COMMANDS, **({DIAGNOSIS: "diagnose"} if "diagnosis" in kinds else {})}
    cases = [
        _case(f"healthy-{name.removesuffix('.toml')}", base, material, command, name)
        for name, command in commands.items()
    ]
    return [*cases, _case("healthy-fmu", base, material, "check", "Motor.fmu")]


def make_case(kind: str, seed: int, index: int, *, material: Path, base: Path) -> Case:
    """Make case ``index`` of a seed under ``base``; the same arguments always make the same case."""
    return KINDS[kind](Random(f"{kind}/{seed}/{index}"), f"{kind}-{seed}-{index}", material, base)


def _case(name: str, base: Path, material: Path, command: str, *arguments: str) -> Case:
    folder = base / name
    shutil.copytree(material, folder, ignore=shutil.ignore_patterns(FINISHED))
    for file, table in SCENARIOS.items():
        (folder / file).write_text(toml(table()), encoding="utf-8")
    options = () if command in ("check", "report") else ("-o", STUDY, "--workers", "1")
    return Case(name, folder, (command, *arguments, *options))


def _scenario(rng: Random, name: str, material: Path, base: Path) -> Case:
    run = rng.choice(tuple(COMMANDS))
    case = _case(name, base, material, COMMANDS[run], run)
    # A stage is as good a place for a mistake as the file that lists it.
    wrong = rng.choice(("stages.toml", "motor.toml", "check.toml")) if run == "stages.toml" else run
    path = case.folder / wrong
    if rng.random() < 0.85:
        path.write_text(toml(scenarios.mutate_tables(rng, SCENARIOS[wrong]())), encoding="utf-8")
    elif rng.random() < 0.5:
        path.write_text(mutate_text(rng, path.read_text(encoding="utf-8")), encoding="utf-8")
    else:
        path.write_bytes(mutate_bytes(rng, path.read_bytes()))
    return case


def _recording(rng: Random, name: str, material: Path, base: Path) -> Case:
    run = rng.choice(("check.toml", "check.toml", "motor.toml"))
    case = _case(name, base, material, COMMANDS[run], run)
    path = recordings.write_mutated(rng, case.folder, samples("motor_m30"))
    chosen = ("--fit", str(path.relative_to(case.folder)))
    if rng.random() < 0.2:
        chosen = ("--fit", "motor_m30.csv", "--validate", chosen[1])
    return Case(name, case.folder, (*case.arguments, *chosen))


def _fmu(rng: Random, name: str, material: Path, base: Path) -> Case:
    command = rng.choice(("check", "check", "check.toml", "check.toml", "motor.toml", "tuning.toml"))
    source = "THSA.fmu" if command == "tuning.toml" else rng.choice(("Motor.fmu", "fmi3_Motor.fmu"))
    mutated = "mutated.fmu"
    if command == "check":
        case = _case(name, base, material, "check", mutated)
    else:
        case = _case(name, base, material, COMMANDS[command], command, "--fmu", mutated)
    archives.write_mutated(rng, material / source, case.folder / mutated, case.folder)
    return case


def _study(rng: Random, name: str, material: Path, base: Path) -> Case:
    run = rng.choice(("motor.toml", "motor.toml", "stages.toml", "tuning.toml"))
    shows = rng.random() < 0.4
    case = (
        _case(name, base, material, "report", STUDY)
        if shows
        else _case(name, base, material, COMMANDS[run], run)
    )
    study = case.folder / STUDY
    shutil.copytree(material / FINISHED / run, study)
    files = sorted(p for p in study.rglob("*") if p.suffix in (".json", ".csv", ".parquet", ".toml"))
    # The files that a continued study reads decide; the others are only overwritten.
    read = [p for p in files if shows or p.name in ("journal.csv", "study.json")]
    path = rng.choice(read if rng.random() < 0.8 else files)
    match rng.randrange(12):
        case 0:
            path.unlink()
        case 1:
            path.unlink()
            path.mkdir()
        case 2 | 3 | 4 | 5 | 6 if path.suffix != ".parquet":
            text = mutate_text(rng, path.read_text(encoding="utf-8"))
            path.write_text(text, encoding="utf-8", errors="replace")
        case 7 | 8 if path.suffix == ".json":
            table = scenarios.mutate_tables(rng, json.loads(path.read_text(encoding="utf-8")))
            path.write_text(json.dumps(table, default=str), encoding="utf-8")
        case _:
            path.write_bytes(mutate_bytes(rng, path.read_bytes()))
    return case


def _diagnosis(rng: Random, name: str, material: Path, base: Path) -> Case:
    case = _case(name, base, material, "diagnose", DIAGNOSIS)
    match rng.randrange(6):
        case 0:
            driven = pd.read_csv(case.folder / "undeclared_fit_1.csv")
            path = recordings.write_mutated(rng, case.folder, driven)
            chosen = (rng.choice(("--fit", "--validate")), str(path.relative_to(case.folder)))
            return Case(name, case.folder, (*case.arguments, *chosen))
        case 1:
            archives.write_mutated(rng, material / "THSA.fmu", case.folder / "mutated.fmu", case.folder)
            return Case(name, case.folder, (*case.arguments, "--fmu", "mutated.fmu"))
        case _:
            table = scenarios.mutate_tables(rng, SCENARIOS[DIAGNOSIS]())
            (case.folder / DIAGNOSIS).write_text(toml(table), encoding="utf-8")
            return case


KINDS: dict[str, Callable[[Random, str, Path, Path], Case]] = {
    "scenario": _scenario,
    "recording": _recording,
    "fmu": _fmu,
    "study": _study,
    "diagnosis": _diagnosis,
}
