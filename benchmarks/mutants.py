"""Mutation testing of the decisions: small changes of the code, and which of them its tests notice.

    python benchmarks/mutants.py [--children 2] [PATTERN ...]

Runs mutmut as `pyproject.toml` says and prints per module how many mutants were noticed, then those that survived.
Leaves with 1 if less than 90 % are noticed. PATTERN restricts it: "thsa_cosim.diagnosis.choosing.gates*".
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
GOAL = 0.9
#: What mutmut says of a mutant that a test noticed; "not checked" ones are left out.
NOTICED = ("killed", "timeout", "segfault", "suspicious")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--children", type=int, default=2, help="tests that run at the same time")
    parser.add_argument("patterns", nargs="*", metavar="PATTERN")
    given = parser.parse_args()
    mutmut = Path(sys.executable).with_name("mutmut")
    environment = {
        k: v for k, v in os.environ.items() if k != "PYTHONPATH"
    }  # the mutated copy is to be imported
    run = [mutmut, "run", "--max-children", str(given.children), *given.patterns]
    subprocess.run(run, cwd=ROOT, env=environment, check=True, stdout=subprocess.DEVNULL)
    results = [mutmut, "results", "--all", "true"]
    said = subprocess.run(
        results, cwd=ROOT, env=environment, check=True, capture_output=True, text=True
    ).stdout
    return report([line.strip() for line in said.splitlines() if ": " in line])


def report(lines: list[str]) -> int:
    """Print what was noticed per module and what survived; 1 below the goal."""
    counts: dict[str, Counter[str]] = {}
    survived = []
    for line in lines:
        name, _, state = line.rpartition(": ")
        if state == "not checked":
            continue
        noticed = state in NOTICED
        counts.setdefault(name.split(".x")[0], Counter())["noticed" if noticed else "survived"] += 1
        survived += [] if noticed else [f"{name}: {state}"]
    total: Counter[str] = sum(counts.values(), Counter())
    for module, own in [*sorted(counts.items()), ("all", total)]:
        print(
            f"{module:50s} {own['noticed']:5d} of {own.total():5d}  {100 * own['noticed'] / (own.total() or 1):5.1f} %"
        )
    print("\n".join(survived))
    return 0 if total and total["noticed"] >= GOAL * total.total() else 1


if __name__ == "__main__":
    sys.exit(main())
