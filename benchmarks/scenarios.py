"""The results of the shipped scenarios beside those of another revision, in units of the stated errors.

    python benchmarks/scenarios.py REVISION [SCENARIO ...] [--output DIR]

The other revision is unpacked and each scenario that both have runs under both, with one worker. Printed per
scenario: CPU seconds; the largest difference of a value that both state with a standard error, over the larger of the
two errors (a value stays "as before" if this is at most 2); of a tuning the final costs and gains; of a diagnosis the
effects. EMPS needs DATA_EMPS.mat in ``../shared/emps``. With ``--output`` the studies are kept, and one that is
finished there is not run again.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
EMPS = ROOT.parent / "shared" / "emps" / "DATA_EMPS.mat"
#: Identifications, tunings and diagnoses state results; simulations only compare signals.
KINDS = ("identify", "tune", "diagnose")
PARTS = ("thsa_cosim", "scenarios", "fmus", "modelica", "pyproject.toml")


def kind(scenario: Path) -> str:
    """The command of a scenario."""
    found: str = tomllib.loads(scenario.read_text(encoding="utf-8"))["kind"]
    return found


def unpack(revision: str, folder: Path) -> None:
    """Write what a study needs of a revision into ``folder``."""
    folder.mkdir(parents=True)
    command = ["git", "archive", revision, *PARTS]
    packed = subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout
    subprocess.run(["tar", "-x", "-C", folder], input=packed, check=True)


def study(root: Path, name: str, folder: Path) -> tuple[dict[str, Any], float]:
    """The result of a scenario under the package in ``root``, and its CPU seconds (0 for one that was kept).

    Raises:
        RuntimeError: The study ended with an error.
    """
    scenario = root / "scenarios" / f"{name}.toml"
    if not (folder / "result.json").is_file():
        data = ["--fit", EMPS] if name == "emps" else []
        command = [
            sys.executable, "-c", "from thsa_cosim.cli import main; main()",
            kind(scenario), scenario, *data, "--output", folder, "--workers", "1", "--no-report", "--quiet",
        ]  # fmt: skip
        environment = {**os.environ, "PYTHONPATH": str(root)}
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            list(map(str, command)), cwd=root, env=environment, capture_output=True, text=True, check=False
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode:
            raise RuntimeError(done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "no message")
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    else:
        seconds = 0.0
    return json.loads((folder / "result.json").read_text(encoding="utf-8")), seconds


def stated(found: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], float, float]]:
    """Every value with a standard error in a result: its path, the value and the error."""
    if isinstance(found, dict):
        if isinstance(found.get("stderr"), float) and isinstance(found.get("value"), float):
            yield path, found["value"], found["stderr"]
        for key, inner in found.items():
            if key not in ("candidates", "before", "generations"):
                yield from stated(inner, (*path, key))
    elif isinstance(found, list):
        for number, inner in enumerate(found):
            named = inner.get("label") or inner.get("name") if isinstance(inner, dict) else None
            yield from stated(inner, (*path, str(named or number)))


def difference(old: dict[str, Any], new: dict[str, Any]) -> str:
    """What became of the results, in one line."""
    before = {path: (value, error) for path, value, error in stated(old)}
    apart = {
        path: abs(value - before[path][0]) / max(error, before[path][1], 1e-300)
        for path, value, error in stated(new)
        if path in before
    }
    said = []
    if apart:
        worst = max(apart, key=lambda path: apart[path])
        said.append(
            f"{len(apart)} values, at most {apart[worst]:.2f} stated errors apart ({' '.join(worst[-3:])})"
        )
    if "effects" in new:
        said.append(
            f"effects {effects(old)} then, {effects(new)} now; verdict {old['verdict']}, {new['verdict']}"
        )
    if "gains" in new and isinstance(new.get("after"), dict):
        said.append(f"cost {cost(old)} then, {cost(new)} now; gains {gains(old)}, {gains(new)}")
    return "; ".join(said) or "nothing to compare"


def effects(result: dict[str, Any]) -> str:
    """The names of the accepted effects."""
    return ", ".join(effect["name"] for effect in result["effects"]) or "none"


def cost(result: dict[str, Any]) -> str:
    """The cost of the tuned gains over all conditions."""
    after = result["after"]
    found = after.get("cost", after.get("total"))
    return f"{found:.6g}" if isinstance(found, float) else "not stated"


def gains(result: dict[str, Any]) -> str:
    """The tuned gains."""
    return ", ".join(f"{name} {value:.4g}" for name, value in (result["gains"] or {}).items())


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("revision")
    parser.add_argument("scenarios", nargs="*", metavar="SCENARIO")
    parser.add_argument("--output", type=Path, help="keep the studies in this folder")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="scenarios", ignore_cleanup_errors=True) as scratch:
        folder = (options.output or Path(scratch)).resolve()
        other = folder / options.revision / "tree"
        if not other.is_dir():
            unpack(options.revision, other)
        for scenario in sorted((other / "scenarios").glob("*.toml")):
            name = scenario.stem
            if (options.scenarios and name not in options.scenarios) or kind(scenario) not in KINDS:
                continue
            if not (ROOT / "scenarios" / scenario.name).is_file():
                print(f"{name:14} is not shipped any more")
            elif name == "emps" and not EMPS.is_file():
                print(f"{name:14} skipped: {EMPS} is missing")
            else:
                print(f"{name:14} {both(name, other, options.revision, folder)}", flush=True)


def both(name: str, other: Path, revision: str, folder: Path) -> str:
    """Run a scenario under both revisions and compare."""
    try:
        old, before = study(other, name, folder / revision / name)
        new, now = study(ROOT, name, folder / "now" / name)
    except RuntimeError as error:
        return f"not compared, a study ended: {error}"
    return f"{before:6.1f} s then, {now:6.1f} s now; {difference(old, new)}"


if __name__ == "__main__":
    main()
