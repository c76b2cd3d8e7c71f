"""Do a diagnosis' stated 95 % intervals hold the truth?  python benchmarks/blind_intervals.py DIR

Reads the units of `benchmarks/blind.py -o DIR`, those that named what is there and nothing else, and compares what they
state with the truth: coefficients of effects whose definition leaves no choice, and the declared parameters that
the result calls identifiable. Prints every error beyond 1.96 stated standard errors, the shares inside, and the errors'
spread over the stated one (1 is right, above: too sure of itself). Goal: 92 to 98 % inside.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from blind_score import estimates, moved, read_score
from scipy.stats import binomtest

INSIDE = 1.96


@dataclass(frozen=True)
class Stated:
    """One number of a result beside the truth; ``kind``: "effect" or "declared"."""

    unit: str
    kind: str
    name: str
    value: float
    stderr: float
    truth: float

    @property
    def errors(self) -> float:
        """Error in stated standard errors."""
        return (self.value - self.truth) / self.stderr


def stated(unit: str, label: Mapping[str, Any], result: Mapping[str, Any]) -> Iterator[Stated]:
    """Every number of a result that has a truth to compare with."""
    for effect in label["effects"]:
        for entry in result["effects"]:
            own, _, place = entry["name"].partition(":")
            if own == effect["name"]:
                true = moved(effect, place, label["rig"])
                for name, value, stderr, truth in estimates(true, entry["parameters"]):
                    yield Stated(unit, "effect", f"{effect['name']} {name}", value, stderr, truth)
    found = result["parameters"]["after" if result["effects"] else "before"]
    for name, entry in found.items():
        if entry["identifiable"] and entry["stderr"] and name in label["rig"]:
            yield Stated(unit, "declared", name, entry["value"], entry["stderr"], label["rig"][name])


def read(folder: Path) -> Iterator[Stated]:
    """What the finished units of a folder state that were answered rightly."""
    for path in sorted((folder / "labels").glob("*.json")):
        unit, study = path.stem, folder / "studies" / path.stem
        label = json.loads(path.read_text())
        if label["kind"] == "outside" or not study.with_suffix(".json").exists():
            continue
        if read_score(unit, path, study).alone or label["kind"] == "clean":
            yield from stated(unit, label, json.loads((study / "result.json").read_text()))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="of benchmarks/blind.py")
    found = list(read(parser.parse_args().folder))
    for s in found:
        if abs(s.errors) > INSIDE:
            print(
                f"{s.unit} {s.name:32s} {s.value:.6g} +- {s.stderr:.2g}, true {s.truth:.6g}: {s.errors:+.1f}"
            )
    for kind in ("effect", "declared"):
        errors = np.array([s.errors for s in found if s.kind == kind])
        if errors.size:
            hits = int(np.sum(np.abs(errors) <= INSIDE))
            interval = binomtest(hits, errors.size).proportion_ci(method="exact")
            print(
                f"{kind:9s} {hits} of {errors.size} inside = {hits / errors.size:.3f}"
                f" ({interval.low:.3f} .. {interval.high:.3f}), spread {np.sqrt(np.mean(errors**2)):.2f},"
                f" median |error| {np.median(np.abs(errors)):.2f}"
            )


if __name__ == "__main__":
    main()
