"""Feed the command line with mutated scenarios, recordings, FMUs and study folders.

    python benchmarks/fuzz.py [--kind scenario] [--count 500] [--seed 1] [--first 0] [--jobs 1] [--keep DIR]

Every case must end before its deadline with exit code 0, 2 or 3, say what is wrong in one sentence, leave no
traceback, no process and no temporary file, and write to its study folder alone (and compiled libraries to a cache of
this run). A case is drawn from its kind, the seed and its index: --first N --count 1 --keep DIR repeats one and keeps
its folder. Exit code 1 if any misbehaved.
"""

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # no threads: this process forks
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from fuzzing.cases import FINISHED, KINDS, STUDY, Case, healthy_cases, make_case
from fuzzing.material import write_material
from fuzzing.sandbox import CACHE, Trial, Verdict


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--kind", choices=KINDS, action="append", help="default: all but diagnosis, which takes long"
    )
    parser.add_argument("--count", type=int, default=500, help="cases of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="index of the first case")
    parser.add_argument("--jobs", type=int, default=1, help="cases at a time")
    parser.add_argument("--deadline", type=float, default=120.0, help="s, of one case")
    parser.add_argument("--verbose", action="store_true", help="also print what well-behaved cases said")
    parser.add_argument("--keep", type=Path, help="work here, and keep the folders of cases that misbehaved")
    arguments = parser.parse_args()
    warm_up()
    kinds = tuple(arguments.kind or (kind for kind in KINDS if kind != "diagnosis"))
    # A TemporaryDirectory would be deleted by every fork's exit.
    scratch = Path(tempfile.mkdtemp(prefix="fuzz-"))
    try:
        base = (arguments.keep or scratch).resolve()
        base.mkdir(parents=True, exist_ok=True)
        # The same run with a full cache of one's own and with an empty one.
        os.environ[CACHE] = str(scratch / "cache")
        material = scratch / "material"
        write_material(material)
        if broken := prepare(kinds, material, scratch, arguments.deadline):
            print(f"healthy input misbehaves: {broken.case.name}: {broken.findings} {broken.errors}")
            return 1
        cases = (
            make_case(kind, arguments.seed, index, material=material, base=base)
            for kind in kinds
            for index in range(arguments.first, arguments.first + arguments.count)
        )
        return report(run(cases, arguments.jobs, arguments.deadline, bool(arguments.keep)), arguments)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def warm_up() -> None:
    """Import what commands import, once, before any fork."""
    import matplotlib

    matplotlib.use("Agg")
    import thsa_cosim.check
    import thsa_cosim.diagnosis
    import thsa_cosim.identify
    import thsa_cosim.report.identify.files
    import thsa_cosim.report.tune.files
    import thsa_cosim.simulate
    import thsa_cosim.staged
    import thsa_cosim.tune  # noqa: F401


def prepare(kinds: tuple[str, ...], material: Path, scratch: Path, deadline: float) -> Verdict | None:
    """Run everything with healthy input, keep the finished studies; return a verdict that is no success."""
    for verdict in run(healthy_cases(kinds, material, scratch / "healthy"), 1, deadline, keep=True):
        if verdict.code != 0 or verdict.findings:
            return verdict
        if verdict.case.writes_result:
            scenario = next(a for a in verdict.case.arguments if a.endswith(".toml"))
            (material / FINISHED).mkdir(exist_ok=True)
            (verdict.case.folder / STUDY).rename(material / FINISHED / scenario)
    return None


def run(cases: Iterable[Case], jobs: int, deadline: float, keep: bool) -> Iterator[Verdict]:
    """Run the cases, ``jobs`` at a time; yield verdicts as they come."""
    waiting = iter(cases)
    running: list[Trial] = []
    while True:
        while len(running) < jobs and (case := next(waiting, None)) is not None:
            running.append(Trial(case, deadline))
        if not running:
            return
        for trial in list(running):
            if (verdict := trial.poll()) is not None:
                running.remove(trial)
                yield verdict
                if not (keep and (verdict.findings or verdict.case.name.startswith("healthy"))):
                    trial.remove()
        time.sleep(0.005)


def report(verdicts: Iterable[Verdict], arguments: argparse.Namespace) -> int:
    """Print every case that misbehaved, then counts; return the exit code."""
    codes: Counter[str] = Counter()
    misbehaved = 0
    slowest, began = 0.0, time.monotonic()
    for verdict in verdicts:
        kind = verdict.case.name.split("-")[0]
        codes[f"{kind}: {verdict.code}"] += 1
        slowest = max(slowest, verdict.seconds)
        if arguments.verbose:
            said = verdict.errors.strip().splitlines() or ["ok"]
            print(f"{verdict.case.name} {verdict.code} {verdict.seconds:.1f} s: {said[-1][:300]}", flush=True)
        if verdict.findings:
            misbehaved += 1
            print(f"\n{verdict.case.name} ({' '.join(verdict.case.arguments)}), {verdict.seconds:.1f} s")
            print("".join(f"  {finding}\n" for finding in verdict.findings), end="", flush=True)
    summary = {
        "seed": arguments.seed,
        "cases": codes.total(),
        "misbehaved": misbehaved,
        "exit_codes": dict(sorted(codes.items())),
        "slowest_s": round(slowest, 1),
        "seconds": round(time.monotonic() - began),
    }
    print(json.dumps(summary))
    return 1 if misbehaved else 0


if __name__ == "__main__":
    sys.exit(main())
