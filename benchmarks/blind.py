"""The blind benchmark of `thsa-cosim diagnose`: units of a plant that shares nothing with the Modelica model.

    python benchmarks/blind.py -o DIR [--units N] [--seed 1] [--jobs 2] [--docs]

Makes the units (each effect of the contract at three strengths, pairs, effects that no catalogue has, clean units),
diagnoses each as a user would, and prints what was reached of every goal, with a binomial interval, and the
confusion matrix. `--units N` takes a balanced part: any N units hold all kinds and effects in proportion. What has
been run is kept: the same command goes on where it was stopped, and a larger N adds to what is there. `--docs` writes
what was reached as docs/blind.md, with the seed and the commits that the units were run on.

    DIR/recordings/u0001/{fit,validate}_{1,2}.parquet   all that the diagnosis sees
    DIR/labels/u0001.json                               the truth
    DIR/studies/u0001/result.json, u0001.json, u0001.log   the study; how long it took; what it printed
    DIR/plan.json, summary.txt            seed and commits; what was reached
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from blind_effects import CATALOGUE
from blind_goals import docs_page, summary
from blind_outside import OUTSIDE
from blind_schedules import PARTS
from blind_score import read_score
from blind_units import STRENGTHS, generate_unit

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs" / "blind.md"
OURS = Path(sys.executable).with_name("thsa-cosim")
SEEDS = 3  # units of each effect and strength
CLEAN, PAIRS = 60, 36
#: Effects whose traces differ too little to ask for two of them: torque that misses in proportion to the load, or by
#: a constant; friction that fades along the stroke; drag at speed; one sensor's errors.
_ALIKE = (
    {"current-sensor-gain", "load-dependent-friction", "torque-constant-saturation", "winding-self-heating"},
    {"current-sensor-offset", "asymmetric-friction"},
    {"position-friction", "friction-run-in"},
    {"windage", "stribeck", "asymmetric-friction"},
    {"velocity-sensor-gain", "velocity-sensor-delay"},
)


@dataclass(frozen=True)
class Unit:
    name: str
    kind: str  # "single", "pair", "outside" or "clean"
    effects: tuple[str, ...]
    strength: str
    seed: int


def plan(seed: int) -> list[Unit]:
    """All units, in an order of which every beginning is balanced."""
    random = np.random.default_rng(seed)
    kinds: dict[str, list[tuple[tuple[str, ...], str]]] = {
        "single": list(_rounds([(name,) for name in CATALOGUE], random)),
        "outside": list(_rounds([(name,) for name in OUTSIDE], random)),
        "pair": _pairs(random),
        "clean": [((), "none")] * CLEAN,
    }
    ranked = sorted(
        ((number + 0.5) / len(found), kind, effects, strength)
        for kind, found in kinds.items()
        for number, (effects, strength) in enumerate(found)
    )
    return [
        Unit(f"u{number:04d}", kind, effects, strength, seed * 100_000 + number)
        for number, (_, kind, effects, strength) in enumerate(ranked, start=1)
    ]


def _rounds(
    effects: list[tuple[str, ...]], random: np.random.Generator
) -> Iterator[tuple[tuple[str, ...], str]]:
    """Every effect once a round, its strength another one in each of three rounds."""
    strengths = list(STRENGTHS)
    offset = random.integers(3, size=len(effects))
    for turn in range(SEEDS * 3):
        for j in random.permutation(len(effects)):
            yield effects[j], strengths[(offset[j] + turn) % 3]


def _pairs(random: np.random.Generator) -> list[tuple[tuple[str, ...], str]]:
    """Two effects that differ in what they act on, medium and strong in turn."""
    told_apart = [
        pair for pair in combinations(CATALOGUE, 2) if not any(set(pair) <= alike for alike in _ALIKE)
    ]
    chosen = random.choice(len(told_apart), size=PAIRS, replace=False)
    return [(told_apart[j], ("medium", "strong")[number % 2]) for number, j in enumerate(chosen)]


def run(unit: Unit, folder: Path, command: list[str], scenario: Path, deadline: float) -> Unit:
    """Make the unit's recordings and diagnose them, each only where that has not been done."""
    label, data = folder / "labels" / f"{unit.name}.json", folder / "recordings" / unit.name
    begin, spent = time.monotonic(), _processor()
    if not label.exists():
        truth = generate_unit(data, unit.effects, unit.strength, unit.seed)
        label.write_text(json.dumps({"kind": unit.kind, **truth}, indent=1))
    study, done = folder / "studies" / unit.name, folder / "studies" / f"{unit.name}.json"
    if done.exists():
        return unit
    files = [word for part in PARTS for word in (f"--{part.split('_')[0]}", str(data / f"{part}.parquet"))]
    made = time.monotonic()
    with study.with_suffix(".log").open("w") as log:
        try:
            ended = subprocess.run(
                [*command, str(scenario), *files, "-o", str(study), "--workers", "1"],
                stdout=log,
                stderr=subprocess.STDOUT,
                timeout=deadline,
                cwd=ROOT,
                check=False,
            )
            code: int | None = ended.returncode
        except subprocess.TimeoutExpired:
            code = None
    took = {
        "exit_code": code,
        "seconds": round(time.monotonic() - made, 1),
        "plant_seconds": round(made - begin, 1),
        "cpu_seconds": round(_processor() - spent, 1),
    }
    done.write_text(json.dumps(took))
    return unit


def _processor() -> float:
    """Processor time in s of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


def note_plan(folder: Path, seed: int, runs: bool) -> list[str]:
    """Write the seed, and the commit that units are run on (``runs``) beside those before; return these commits.

    ValueError if the folder was begun with another seed.
    """
    file = folder / "plan.json"
    known = json.loads(file.read_text()) if file.exists() else {"seed": seed}
    if known["seed"] != seed:
        raise ValueError(f"{folder} was begun with --seed {known['seed']}")
    commits = dict.fromkeys(known.get("commits", []))
    if runs:
        commits[_commit()] = None
    file.write_text(json.dumps({"seed": seed, "commits": list(commits)}))
    return list(commits)


def _commit() -> str:
    """The commit of this checkout, with ``-dirty`` where its code was changed since."""
    command = ["git", "describe", "--always", "--dirty", "--exclude", "*"]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return found.stdout.strip() or "unknown"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder to write to, or to continue")
    parser.add_argument("--units", type=int, help="how many, a balanced part of all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2, help="units at a time")
    parser.add_argument("--deadline", type=float, default=1200.0, help="s, for one diagnosis")
    parser.add_argument("--scenario", type=Path, default=ROOT / "scenarios" / "driven.toml")
    parser.add_argument("--command", help="what diagnoses (thsa-cosim diagnose)")
    parser.add_argument(
        "--docs", nargs="?", type=Path, const=DOCS, help="write what was reached as a page (docs/blind.md)"
    )
    options = parser.parse_args()

    folder = options.output.resolve()
    for part in ("labels", "recordings", "studies"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    command = shlex.split(options.command) if options.command else [str(OURS), "diagnose"]
    whole = plan(options.seed)
    units = whole[: options.units]
    try:
        runs = any(not (folder / "studies" / f"{u.name}.json").exists() for u in units)
        commits = note_plan(folder, options.seed, runs)
    except ValueError as wrong:
        parser.error(str(wrong))
    scores = []
    with ProcessPoolExecutor(options.jobs, multiprocessing.get_context("spawn")) as pool:
        waiting = [
            pool.submit(run, u, folder, command, options.scenario.resolve(), options.deadline) for u in units
        ]
        for ended in as_completed(waiting):
            name = ended.result().name
            found = read_score(name, folder / "labels" / f"{name}.json", folder / "studies" / name)
            scores.append(found)
            print(
                f"{len(scores):3d}/{len(units)} {name} {'ok' if found.right else 'NO'} {found.strength:6s} "
                f"{' + '.join(found.truth) or 'clean':40s} -> {found.verdict} {', '.join(found.names)}",
                flush=True,
            )
    scores.sort(key=lambda found: found.unit)
    text = summary(scores, len(whole))
    (folder / "summary.txt").write_text(text + "\n")
    print(text)
    if options.docs:
        page = docs_page(text, seed=options.seed, commits=commits, count=len(units), whole=len(whole))
        options.docs.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
