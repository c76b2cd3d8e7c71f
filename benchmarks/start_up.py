"""Processor time of ``--help`` and of imports, beside another revision of this repository.

``python benchmarks/start_up.py REVISION`` checks the revision out into a temporary folder and starts both versions in
turn, in this environment; it prints the medians in ms and the median of the pairs' ratios.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
STARTS = {
    "thsa-cosim --help": "from thsa_cosim.cli import main; main()",
    "thsa-cosim identify --help": "import sys; sys.argv.insert(1, 'identify'); from thsa_cosim.cli import main; main()",
    "import thsa_cosim": "import thsa_cosim",
}


def main(revision: str, pairs: int) -> None:
    """Print one line for each way to start."""
    with tempfile.TemporaryDirectory(prefix="start-up") as temporary:
        other, cache = Path(temporary, "other"), Path(temporary, "bytecode")
        archive = subprocess.run(
            ["git", "archive", revision, "thsa_cosim"], cwd=ROOT, capture_output=True, check=True
        )
        other.mkdir()
        subprocess.run(["tar", "-x", "-C", other], input=archive.stdout, check=True)
        for name, code in STARTS.items():
            for root in (other, ROOT):
                cpu(root, code, cache)  # writes the bytecode
            times = [(cpu(other, code, cache), cpu(ROOT, code, cache)) for _ in range(pairs)]
            before, now = (1e3 * statistics.median(own) for own in zip(*times, strict=True))
            ratio = statistics.median(b / a for a, b in times)
            print(f"{name:28} {revision} {before:5.0f} ms, now {now:5.0f} ms, ratio {ratio:.2f}", flush=True)


def cpu(root: Path, code: str, cache: Path) -> float:
    """Seconds of processor time of one start of the package in ``root``."""
    environment = {**os.environ, "PYTHONPATH": str(root), "PYTHONPYCACHEPREFIX": str(cache)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    process = subprocess.Popen(
        [sys.executable, "-c", code, "--help"], cwd=cache.parent, env=environment, stdout=subprocess.DEVNULL
    )
    _, status, used = os.wait4(process.pid, 0)
    if status:
        raise RuntimeError(f"{code!r} in {root} ended with status {status}.")
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("revision", help="what to compare with")
    parser.add_argument("--pairs", type=int, default=15)
    options = parser.parse_args()
    main(options.revision, options.pairs)
