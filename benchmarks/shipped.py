"""The shipped FMUs beside those of another revision: their results, and the cost of their right-hand sides.

    python benchmarks/shipped.py REVISION [--only TEXT] [--pairs 41]

Takes the archives of both revisions as they are in the repository. Every FMU that both have is run over the same
inputs (two sines each, in the unit's usual size, with reversals) at a tolerance of 1e-8; printed is the largest
difference of an output, relative to its range, and of which. The right-hand sides are compiled from the C sources in
the archives and timed in turns, in CPU time: the median of the pairs' ratios (new to old), and their middle half. The
last ratio is that of the exporter alone: the other revision's Modelica as this one exports it, to the old archive.
"""

import argparse
import ctypes
import io
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from fmu import LOOP

from thsa_cosim.export.archive import make_sources
from thsa_cosim.export.causal import make_causal
from thsa_cosim.export.compile import PLATFORMS, compile_library
from thsa_cosim.export.flatten import flatten
from thsa_cosim.export.manifest import read_manifest
from thsa_cosim.fmu import Plant
from thsa_cosim.signals import Signals

ROOT = Path(__file__).parent.parent
SIZES = {"m/s": 0.01, "rad/s": 50.0, "m": 0.1, "N": 5e3, "V": 5.0, "A": 5.0, "rad": 0.5}
REPEATS = 200_000


def inputs(plant: Plant, t: np.ndarray) -> dict[str, np.ndarray]:
    """Signals of the inputs whose unit has a usual size; the others keep their start value."""
    moved = [v for v in plant.description.inputs if v.unit in SIZES]
    return {
        v.name: SIZES[v.unit or ""] * (np.sin(2.1 * (k + 1) * t) + 0.4 * np.sin(11.3 * t / (k + 1)))
        for k, v in enumerate(moved)
    }


def difference(old: Path, new: Path) -> str:
    """The largest difference of an output over one run."""
    with Plant.open(new) as plant, Plant.open(old) as former:
        stop = min(3.0, plant.description.default_experiment.stop or 3.0)
        t = np.linspace(0.0, stop, 3001)
        shared = {v.name for v in former.description.outputs}
        names = [v.name for v in plant.description.outputs if v.name in shared]
        known = {v.name for v in former.description.inputs}
        signals = {n: y for n, y in inputs(plant, t).items() if n in known}
        driven = Signals(t, signals)
        ours = plant.run({}, driven, names, t, tolerance=1e-8)
        theirs = former.run({}, driven, names, t, tolerance=1e-8)
    apart = {n: float(np.max(np.abs(ours[n] - theirs[n])) / max(np.ptp(theirs[n]), 1e-12)) for n in names}
    worst = max(apart, key=lambda n: apart[n])
    return f"{len(names):2d} outputs, largest difference {apart[worst]:.1e} of the range of {worst}"


class RightHandSide:
    """The right-hand side of an archive's C sources, in a loop."""

    def __init__(self, folder: Path) -> None:
        (folder / "sources" / "loop.c").write_text(LOOP)
        suffix = {"linux": ".so", "darwin": ".dylib", "win32": ".dll"}[sys.platform]
        platform = next(p for p in PLATFORMS if p.suffix == suffix)
        compile_library(folder / "sources", ["loop.c", "model.c"], platform, folder / f"loop{suffix}")
        self.evaluate = ctypes.CDLL(str(folder / f"loop{suffix}")).evaluate
        self.evaluate.argtypes = [ctypes.c_long, ctypes.c_int, *3 * [ctypes.c_void_p]]
        self.evaluate.restype = ctypes.c_double
        self.point = [np.full(400, 0.01), np.full(50, 0.01), np.zeros(400)]

    def seconds(self) -> float:
        """CPU time of one turn."""
        start = time.thread_time()
        self.evaluate(REPEATS, 0, *(a.ctypes.data for a in self.point))
        return time.thread_time() - start


def unpacked(fmu: Path, folder: Path) -> Path:
    """The folder with the contents of an archive."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    return folder


def exported(model: str, package: Path, folder: Path) -> Path:
    """The folder with the sources of a class as this revision exports it."""
    sources = make_sources(make_causal(flatten(model, package)), 2)
    (folder / "sources").mkdir(parents=True)
    for name, content in sources.files.items():
        (folder / "sources" / name).write_bytes(content)
    return folder


def ratio(old: RightHandSide, new: RightHandSide, pairs: int) -> str:
    """New to old, by turns."""
    for side in (old, new):
        side.seconds()
    found = []
    for pair in range(pairs):
        spent = {side: side.seconds() for side in ((old, new) if pair % 2 else (new, old))}
        found.append(spent[new] / spent[old])
    low, middle, high = np.quantile(found, (0.25, 0.5, 0.75))
    return f"{middle:.3f} ({low:.3f} to {high:.3f})"


def right_hand_sides(model: str, archives: tuple[Path, Path], package: Path, pairs: int) -> str:
    """Both ratios, of the archives (old, new) and of the exporter alone."""
    scratch = Path(tempfile.mkdtemp())
    try:
        old, new = (
            RightHandSide(unpacked(fmu, scratch / side))
            for fmu, side in zip(archives, ("old", "new"), strict=True)
        )
        alone = RightHandSide(exported(model, package, scratch / "again"))
        return f"right-hand side {ratio(old, new, pairs)}, exporter alone {ratio(old, alone, pairs)}"
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def former_package(revision: str, folder: Path) -> tuple[Path, dict[str, str]]:
    """The Modelica package of another revision, and the classes of its archives."""
    command = ["git", "archive", revision, "modelica", "fmus/manifest.json"]
    packed = subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        archive.extractall(folder, filter="data")
    package, entries = read_manifest(folder / "fmus" / "manifest.json")
    return package, {f"fmus/{entry.file}": entry.model for entry in entries}


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("revision")
    parser.add_argument("--only", default="", help="FMUs whose path holds this text")
    parser.add_argument("--pairs", type=int, default=41)
    options = parser.parse_args()
    listed = subprocess.run(
        ["git", "ls-tree", "-r", "--name-only", options.revision, "fmus"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch:
        package, models = former_package(options.revision, Path(scratch) / "former")
        for name in (n for n in listed if n.endswith(".fmu") and options.only in n):
            if not (ROOT / name).is_file():
                print(f"{name:30s} is not shipped any more")
                continue
            old = Path(scratch) / name.replace("/", "_")
            show = ["git", "show", f"{options.revision}:{name}"]
            old.write_bytes(subprocess.run(show, cwd=ROOT, capture_output=True, check=True).stdout)
            found = difference(old, ROOT / name)
            cost = ""
            if "fmi3" not in name:
                cost = "; " + right_hand_sides(models[name], (old, ROOT / name), package, options.pairs)
            print(f"{name:30s} {found}{cost}", flush=True)


if __name__ == "__main__":
    main()
