"""Mutation testing of the decisions: small changes of the code, and which of them its tests notice.

    python benchmarks/mutants.py [--children 2] [--sample N] [--known] [PATTERN ...]

Runs mutmut as `pyproject.toml` says and prints per module how many mutants were noticed, then those that survived.
Leaves with 1 if less than 90 % are noticed. PATTERN restricts it: "thsa_cosim.diagnosis.choosing.gates*". All take
hours: ``--sample 25`` tries mutants drawn by chance until 25 of every module are known, and the last line says what
that makes of all of them. What a run before has found out is kept as long as the code is the same; ``--known`` prints
it and runs nothing.
"""

from __future__ import annotations

import argparse
import fnmatch
import math
import os
import random
import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
GOAL = 0.9
#: What mutmut says of a mutant that a test noticed; "not checked" ones are left out.
NOTICED = ("killed", "timeout", "segfault", "suspicious")
UNKNOWN = "not checked"
#: A small module that makes mutmut write the mutants of all.
FIRST = "thsa_cosim.study.digest*"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--children", type=int, default=2, help="tests that run at the same time")
    parser.add_argument(
        "--sample", type=int, metavar="N", help="try mutants until N of every module are known"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--known", action="store_true", help="print what runs before have found out")
    parser.add_argument("patterns", nargs="*", metavar="PATTERN")
    given = parser.parse_args()
    run = ("run", "--max-children", str(given.children))
    if given.sample and not given.known:
        if not states():
            mutmut(*run, FIRST)  # which makes all mutants
        if chosen := sample(meant(states(), given.patterns), given.sample, given.seed):
            mutmut(*run, *chosen)
    elif not given.known:
        mutmut(*run, *given.patterns)
    return report(meant(states(), given.patterns))


def mutmut(*arguments: str) -> str:
    """Run mutmut; what it printed."""
    program = Path(sys.executable).with_name("mutmut")
    environment = {
        k: v for k, v in os.environ.items() if k != "PYTHONPATH"
    }  # the mutated copy is to be imported
    done = subprocess.run(
        [program, *arguments], cwd=ROOT, env=environment, check=True, stdout=subprocess.PIPE, text=True
    )
    return done.stdout


def states() -> dict[str, str]:
    """What is known of every mutant, by its name; empty before a first run."""
    if not (ROOT / "mutants").is_dir():
        return {}
    said = mutmut("results", "--all", "true")
    rows = (line.strip().rpartition(": ") for line in said.splitlines() if ": " in line)
    return {name: state for name, _, state in rows}


def module(name: str) -> str:
    """The module of a mutant."""
    return name.split(".x")[0]


def meant(known: dict[str, str], patterns: list[str]) -> dict[str, str]:
    """Those of the mutants that a pattern matches; without patterns all."""
    return {
        name: state
        for name, state in known.items()
        if not patterns or any(fnmatch.fnmatch(name, pattern) for pattern in patterns)
    }


def sample(known: dict[str, str], count: int, seed: int) -> list[str]:
    """As many unknown mutants of every module as make ``count`` that are known, or all of a smaller one."""
    chance = random.Random(seed)
    by_module: dict[str, list[str]] = {}
    for name in known:
        by_module.setdefault(module(name), []).append(name)
    chosen = []
    for own in by_module.values():
        unknown = [name for name in own if known[name] == UNKNOWN]
        wanted = count - (len(own) - len(unknown))
        chosen += chance.sample(unknown, min(max(wanted, 0), len(unknown)))
    return chosen


def report(known: dict[str, str]) -> int:
    """Print what was noticed per module and what survived; 1 below the goal.

    Where only some mutants of a module were tried, the last line says what share of all is noticed: each module's share
    by its size, with its standard error.
    """
    sizes = Counter(map(module, known))
    counted = {name: state for name, state in known.items() if state != UNKNOWN}
    noticed = Counter(module(name) for name, state in counted.items() if state in NOTICED)
    total = Counter(map(module, counted))
    if not total:
        return 1
    print("\n".join(f"{name}: {state}" for name, state in counted.items() if state not in NOTICED))
    for name in sorted(total):
        _print(name, noticed[name], total[name], sizes[name])
    whole = sum(sizes[name] for name in total)
    _print("all", noticed.total(), total.total(), whole)
    share, error = estimate(noticed, total, sizes)
    if total.total() < whole:
        print(f"of all {whole} mutants {100 * share:.1f} +- {100 * error:.1f} % (one standard error)")
    return 0 if share >= GOAL else 1


def estimate(noticed: Counter[str], total: Counter[str], sizes: Counter[str]) -> tuple[float, float]:
    """Share of all mutants of the sampled modules that is noticed, and its error (drawn without replacement)."""
    whole = sum(sizes[name] for name in total)
    share = sum(sizes[name] * noticed[name] / n for name, n in total.items()) / whole
    variance = sum(
        (sizes[name] / whole) ** 2
        * (noticed[name] / n)
        * (1.0 - noticed[name] / n)
        / max(n - 1, 1)
        * (1.0 - n / sizes[name])
        for name, n in total.items()
    )
    return share, math.sqrt(variance)


def _print(name: str, noticed: int, tried: int, size: int) -> None:
    print(f"{name:50s} {noticed:5d} of {tried:5d} tried of {size:5d}  {100 * noticed / tried:5.1f} %")


if __name__ == "__main__":
    sys.exit(main())
