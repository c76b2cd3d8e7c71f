"""How much memory a diagnosis of a long recording takes: parent, supervisors and workers together.

    python benchmarks/memory.py [--minutes 10] [--workers 1] [--limit-mb 2000] [--output DIR]

A rig of the blind benchmark, off its drawing and with Stribeck friction at the nut, is simulated by the benchmark's own
plant: one recording of ``--minutes`` at 1 kHz to fit, one of 20 s to validate. ``thsa-cosim diagnose`` with the whole
catalogue then runs on both, while the proportional set size (PSS: shared pages count once) of its processes is
read four times a second. A child between ``vfork`` and ``exec`` is left out: it still is in its parent's memory, which
would count twice. Printed: the CPU time; the peaks of the sum, of the parent and of the largest worker, and when they
were. The exit code is 1 above ``--limit-mb`` (MB of 10^6 bytes).
"""

import argparse
import ctypes
import json
import os
import platform
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from blind_plant import Undeclared, Wave, simulate
from blind_schedules import Schedule, schedule
from blind_units import recording, unit_rig

SCENARIO = Path(__file__).resolve().parent.parent / "scenarios" / "driven.toml"
TEMPERATURE, STRIBECK_N = 0.0, 1500.0
PAUSE_ROWS = 1000
"""Samples between two pieces of a long schedule, in which command and load go to where the next one begins."""
EVERY_S = 0.25


def long_schedule(seconds: float, random: np.random.Generator) -> Schedule:
    """Schedules of the blind benchmark, one after the other."""
    parts: list[list[np.ndarray]] = [[], [], [], []]
    rows = 0
    while rows < seconds * 1e3:
        piece = schedule(("fit_1", "fit_2")[len(parts[0]) % 2], random)
        for k, wave in enumerate((piece.command, piece.load)):
            inside = wave[0] < piece.rows * 1e-3
            last = np.interp(piece.rows * 1e-3, *wave)
            parts[2 * k].append(np.append(wave[0][inside], piece.rows * 1e-3) + rows * 1e-3)
            parts[2 * k + 1].append(np.append(wave[1][inside], last))
        rows += piece.rows + PAUSE_ROWS
    waves = [np.concatenate(part) for part in parts]
    return Schedule(Wave(*waves[:2]), Wave(*waves[2:]), min(rows, round(seconds * 1e3)))


def record(folder: Path, minutes: float) -> tuple[Path, Path]:
    """Write the recording to fit and the one to validate."""
    random = np.random.default_rng(15)
    rig, found = unit_rig(TEMPERATURE, random), []
    for name, played in (
        ("fit", long_schedule(60.0 * minutes, random)),
        ("validate", schedule("validate_1", random)),
    ):
        table = recording(
            simulate(rig, *played, Undeclared(stribeck_nut=STRIBECK_N)), played, TEMPERATURE, random
        )
        found.append(folder / f"{name}.parquet")
        table.to_parquet(found[-1])
    return found[0], found[1]


@dataclass
class Peaks:
    """Largest PSS in bytes, and the second in which it was seen."""

    whole: tuple[int, float] = (0, 0.0)
    parent: tuple[int, float] = (0, 0.0)
    worker: tuple[int, float] = (0, 0.0)
    began: float = field(default_factory=time.monotonic)

    def note(self, parent: int) -> None:
        """Read the processes of ``parent`` once."""
        now = time.monotonic() - self.began
        below = list(descendants(parent))
        own, others = pss(parent), [pss(pid) for pid, above in below if not shares_memory(pid, above)]
        self.parent = max(self.parent, (own, now))
        self.worker = max(self.worker, (max(others, default=0), now))
        self.whole = max(self.whole, (own + sum(others), now))


def pss(pid: int) -> int:
    """Proportional set size in bytes (resident size where the system has none); 0 for a process that is gone."""
    for name, key in (("smaps_rollup", "Pss"), ("status", "VmRSS")):
        try:
            text = Path(f"/proc/{pid}/{name}").read_text(encoding="ascii")
        except OSError:
            continue
        if found := re.search(rf"^{key}:\s+(\d+) kB", text, re.MULTILINE):
            return 1024 * int(found[1])
    return 0


def shares_memory(pid: int, other: int) -> bool:
    """Whether two processes have one address space (kcmp(2)); False where that cannot be asked."""
    number = _KCMP.get(platform.machine())
    if number is None or sys.platform != "linux":
        return False
    libc = ctypes.CDLL(None)
    return bool(libc.syscall(number, pid, other, _KCMP_VM, 0, 0) == 0)


_KCMP, _KCMP_VM = {"x86_64": 312, "aarch64": 272}, 1


def descendants(parent: int) -> Iterator[tuple[int, int]]:
    """Ids of the processes below ``parent``, each with that of the process that started it."""
    children: dict[int, list[int]] = {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                above = int((folder / "stat").read_text(encoding="ascii").rpartition(")")[2].split()[1])
            except OSError:
                continue
            children.setdefault(above, []).append(int(folder.name))
    waiting = [(pid, parent) for pid in children.get(parent, ())]
    while waiting:
        yield (found := waiting.pop())
        waiting += [(pid, found[0]) for pid in children.get(found[0], ())]


def main() -> int:
    """Make the recordings, run the diagnosis, print the peaks."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--limit-mb", type=float, default=2000.0)
    parser.add_argument("--output", type=Path, help="keep recordings and study there")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.output or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        fit, validate = record(folder, options.minutes)
        command = [sys.executable, "-m", "thsa_cosim.cli", "diagnose", str(SCENARIO)]
        command += ["--fit", str(fit), "--validate", str(validate), "-o", str(folder / "study")]
        run = subprocess.Popen([*command, "--workers", str(options.workers), "--quiet"], env=os.environ)
        peaks = Peaks()
        while run.poll() is None:
            peaks.note(run.pid)
            time.sleep(EVERY_S)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        found = folder / "study" / "result.json"
        result = json.loads(found.read_text(encoding="utf-8")) if found.exists() else {}
    named = [effect["name"] for effect in result.get("effects", ())]
    print(
        f"{options.minutes:g} min at 1 kHz: exit {run.returncode}, {result.get('verdict', 'no result')}, {named}"
    )
    print(f"{used.ru_utime + used.ru_stime:.0f} CPU s, {time.monotonic() - peaks.began:.0f} s wall")
    for name in ("whole", "parent", "worker"):
        size, when = getattr(peaks, name)
        print(f"peak of {name:6s} {size / 1e6:6.0f} MB at {when:.0f} s")
    return int(peaks.whole[0] > 1e6 * options.limit_mb or run.returncode != 0)


if __name__ == "__main__":
    sys.exit(main())
