"""Leave-one-out discovery: is the law of an effect found once the catalogue does not know it?

    python benchmarks/blind_discovery.py -o DIR [--effect NAME]... [--units 1] [--clean 0] [--seed 1] [--jobs 1]
                                         [--limit 600]

For each effect of the blind benchmark (or those named) so many units with it alone, of medium and strong size in turn;
each is diagnosed with the effect removed from the catalogue, with ``empirical = true``. Whatever the extended model has
at the effect's place by then, terms of an empirical law or other effects, is the law that was found. It is compared
with the true one over the held-out recordings: deviation (root mean squares, and largest values) over the size of the
true law, less what the declared parameters of the place can take up of either. Clean units are diagnosed likewise, each
without one effect: nothing is to be invented there. What has been run is kept in DIR. A unit whose
diagnosis has not ended after the limit is given up and counted as missed, a clean one, too: it has no result.

Where effects that are left, at another place, explain the held-out recordings to the noise (an offset of the current
sensor as asymmetric friction), the recordings cannot tell the removed law from them. The diagnosis then names the laws
that explain the recordings as well as those effects, in place of them; if one of these is the true law, it was found,
by a tie. Else such a unit is "imitated" and missed. Goal: within 5 % in 80 % of the units, nothing invented on clean
ones; printed of all units, without those found by a tie, and of those that are not imitated.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import signal
import time
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
from blind_effects import CATALOGUE, combined
from blind_laws import SLOTS, joined, law_at, place_of
from blind_plant import FloatArray, Rig
from blind_schedules import PARTS
from blind_score import HELD_OUT, held_out
from blind_units import generate_unit
from scipy.stats import binomtest

from thsa_cosim.api.conduct import ask, conduct
from thsa_cosim.batch import Job
from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.diagnosis.fitting.drawing import declared_unknowns
from thsa_cosim.diagnosis.fitting.trials import trials_of
from thsa_cosim.diagnosis.results import DiagnosisResult, EmpiricalLaw, RivalLaw, Value
from thsa_cosim.errors import ThsaCosimError
from thsa_cosim.fmu import read_description
from thsa_cosim.scenario import Executor, Scenario

ROOT = Path(__file__).resolve().parents[1]
WITHIN = 0.05
SIZES = ("medium", "strong")
NO_RESULT = "no result"


class OutOfTime(BaseException):
    """A unit's limit is over; no Exception, so that nothing on the way takes it for a failed run."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raises OutOfTime in the block once it has taken so long; in the main thread of a process only."""

    def end(number: int, frame: FrameType | None) -> None:
        raise OutOfTime

    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@dataclass(frozen=True)
class Unit:
    """``removed`` from the catalogue; it is there unless the unit is ``clean``."""

    name: str
    removed: str
    size: str
    clean: bool
    seed: int


@dataclass(frozen=True)
class Discovery:
    """What became of a unit; deviations are None where nothing can be compared."""

    unit: str
    removed: str
    clean: bool
    place: str
    form: str
    verdict: str
    law: tuple[str, ...]
    rms: float | None
    largest: float | None
    seconds: float
    held_out: float | None = None  # largest rmse over the sensors' noise on the held-out recordings, after
    instead: tuple[str, ...] = ()  # laws that tie with the effects
    by_tie: bool = False  # whether the deviations are those of one of them

    @property
    def imitated(self) -> bool:
        """Whether effects of the catalogue alone explain the recordings to the noise, by another law."""
        named = bool(self.law) and not any("@" in term for term in self.law)
        to_the_noise = self.held_out is not None and self.held_out <= HELD_OUT
        return not self.clean and named and to_the_noise and not self.found

    @property
    def found(self) -> bool:
        """Whether the law is within the goal; on a clean unit whether nothing was invented."""
        if self.clean:
            return not self.law and not self.verdict.startswith(NO_RESULT)
        return self.rms is not None and self.rms <= WITHIN

    @property
    def everywhere(self) -> bool:
        """Whether its largest deviation is within the goal, too."""
        return self.found and (self.clean or (self.largest is not None and self.largest <= WITHIN))


def plan(effects: Sequence[str], units: int, clean: int, seed: int) -> list[Unit]:
    """So many units of each effect, in rounds, then the clean ones."""
    order = list(CATALOGUE)
    found = [
        Unit(f"{name}-{turn}", name, SIZES[turn % 2], False, seed * 100_000 + 100 * order.index(name) + turn)
        for turn in range(units)
        for name in effects
    ]
    for number in range(clean):
        own = seed * 100_000 + 50_000 + number
        found.append(Unit(f"clean-{number}", effects[number % len(effects)], "none", True, own))
    return found


def run(unit: Unit, folder: Path, scenario: Path, limit: float) -> Discovery:
    """Make the unit, diagnose it without its effect, compare the laws; each only where that has not been done."""
    kept = folder / f"{unit.name}.json"
    if kept.exists():
        entry = json.loads(kept.read_text())
        return Discovery(**{**entry, "law": tuple(entry["law"]), "instead": tuple(entry["instead"])})
    data = folder / unit.name / "recordings"
    label = generate_unit(data, () if unit.clean else (unit.removed,), unit.size, unit.seed)
    files: dict[str, list[str]] = {"fit": [], "validate": []}
    for part in PARTS:
        files[part.split("_")[0]].append(str(data / f"{part}.parquet"))
    begin = time.monotonic()
    asked = ask(
        "diagnose", without(unit.removed, scenario), **files, folder=folder / unit.name / "study", workers=1
    )
    found = Discovery(unit.name, unit.removed, unit.clean, "", "", NO_RESULT, (), None, None, 0.0)
    try:
        with limited(limit):
            result = conduct(asked, quiet=True).result
    except ThsaCosimError as error:
        found = replace(found, verdict=f"{NO_RESULT}: {error}")
    except OutOfTime:
        found = replace(found, verdict=f"{NO_RESULT}: not ended after {limit:.0f} s")
    else:
        found = compared(found, label, asked.scenario, result, folder / unit.name / "study")
        written = json.loads((folder / unit.name / "study" / "result.json").read_text())
        found = replace(found, held_out=held_out(written))
    found = replace(found, seconds=round(time.monotonic() - begin, 1))
    kept.write_text(json.dumps(asdict(found), indent=1))
    return found


def without(effect: str, scenario: Path) -> dict[str, Any]:
    """The scenario's tables with ``effect`` removed from the catalogue and a law searched for."""
    content = tomllib.loads(scenario.read_text())
    content["fmu"] = str(scenario.parent / content["fmu"])
    options = content["diagnose"]
    options["package"] = str(scenario.parent / options["package"])
    options["effects"] = [name for name in known_effects() if name != effect]
    options["empirical"] = True
    return content


def compared(
    found: Discovery,
    label: Mapping[str, Any],
    scenario: Scenario,
    result: DiagnosisResult,
    study: Path,
) -> Discovery:
    """``found`` with what a diagnosis made of the unit, in the folder ``study``."""
    law = [effect.name for effect in result.effects]
    if result.empirical is not None:
        law += _terms(result.empirical)
    instead = tuple(" + ".join(_terms(rival)) for rival in result.instead)
    found = replace(found, verdict=result.verdict, law=tuple(law), instead=instead)
    if found.clean:
        return found
    [effect] = label["effects"]
    rig, extra = Rig(**label["rig"]), combined(effect["fields"])
    place = place_of(extra)
    models = []
    if result.extended_fmu is not None:
        own = {v.variable: v.value for e in result.effects for v in e.parameters.values()}
        models.append((result.extended_fmu, result.declared_after, {**own, **_values(result.empirical)}))
    # The model of all terms is kept with the study; those that a law has not are zero.
    models += [(_library(study), rival.declared, _values(rival)) for rival in result.instead]
    deviations = [
        joined([law_at(place, when, at, rig, extra) for when, at in model_runs(scenario, *model)]).deviation()
        for model in models
    ]
    best = min(range(len(models)), key=lambda k: deviations[k][0], default=None)
    rms, largest = (1.0, 1.0) if best is None else deviations[best]
    return replace(
        found,
        place=place,
        form=effect["form"],
        rms=round(rms, 4),
        largest=round(largest, 4),
        by_tie=bool(best),
    )


def _terms(law: EmpiricalLaw | RivalLaw) -> list[str]:
    return [f"{t.coefficient.value:.4g} {t.coefficient.unit} {t.term}@{t.slot}" for t in law.terms]


def _values(law: EmpiricalLaw | RivalLaw | None) -> dict[str, float]:
    """By FMU variable."""
    terms = () if law is None else law.terms
    return {v.variable: v.value for t in terms for v in (t.coefficient, *t.shapes.values())}


def _library(study: Path) -> Path:
    [fmu] = study.glob("superset/*_empirical.fmu")
    return fmu


def model_runs(
    scenario: Scenario, fmu: Path, declared: Mapping[str, Value], own: Mapping[str, float]
) -> list[tuple[FloatArray, dict[str, FloatArray]]]:
    """Times and the slots' signals of a model with ``declared`` and its ``own`` values on the held-out recordings."""
    trials = [t for t in trials_of(scenario) if t.part == "validate"]
    members = declared_unknowns(scenario, trials_of(scenario)).members
    values = {**own, **{u.variable: declared[u.name].value + u.offset for u in members}}
    wanted = [f"{slot}.{name}" for slot, names in SLOTS.items() for name in names]
    known = read_description(fmu).variables
    outputs = tuple(name for name in wanted if name in known)
    experiments = [replace(t.case.experiment(t.name, None), fmu=fmu, outputs=outputs) for t in trials]
    with Executor(1).open_runner(scenario.simulation, experiments) as runner:
        outcomes = runner.run([Job(e.name, values) for e in experiments])
    found = []
    for outcome in outcomes:
        signals = outcome.signals
        assert signals is not None, outcome.reason
        own = {n: signals[n] if n in outputs else np.zeros(signals.time.size) for n in wanted}
        found.append((signals.time, own))
    return found


def summary(found: Sequence[Discovery]) -> str:
    """A row for every unit, and the goals."""
    lines = [
        f"{'unit':32s} {'place':16s} {'form':34s} {'rms':>7s} {'largest':>7s} {'noise':>5s} {'s':>4s}  verdict: law"
    ]
    lines += [
        f"{d.unit:32s} {d.place:16s} {d.form:34s} {_percent(d.rms)} {_percent(d.largest)}"
        f" {'    -' if d.held_out is None else format(d.held_out, '5.2f')} {d.seconds:4.0f}"
        f"  {d.verdict}: {', '.join(d.law) or 'nothing'}"
        f"{''.join(f' | or {law}' for law in d.instead)}{' (imitated)' if d.imitated else ''}"
        for d in found
    ]
    real, clean = [d for d in found if not d.clean], [d for d in found if d.clean]
    lines += [
        "",
        _goal("found law within 5 % (rms)", ">= 80 %", [d.found for d in real]),
        _goal("  ... not by a tie", "", [d.found and not d.by_tie for d in real]),
        _goal("  ... of units not imitated", "", [d.found for d in real if not d.imitated]),
        _goal("  ... and nowhere further off", "", [d.everywhere for d in real]),
        _goal(
            "  ... by an empirical law alone", "", [d.found and all("@" in t for t in d.law) for d in real]
        ),
        _goal("clean units without a law", "all", [d.found for d in clean]),
    ]
    return "\n".join(lines)


def _percent(value: float | None) -> str:
    return "      -" if value is None else f"{100.0 * value:5.1f} %"


def _goal(text: str, goal: str, hits: Sequence[bool]) -> str:
    if not hits:
        return f"{text:34s} {goal:8s} no case"
    interval = binomtest(sum(hits), len(hits)).proportion_ci(method="exact")
    return f"{text:34s} {goal:8s} {sum(hits)} of {len(hits)}  ({interval.low:.2f} .. {interval.high:.2f})"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder to write to, or to continue")
    parser.add_argument(
        "--effect", action="append", choices=list(CATALOGUE), help="to remove (default: each)"
    )
    parser.add_argument("--units", type=int, default=1, help="of each effect")
    parser.add_argument("--clean", type=int, default=0, help="clean units")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="units at a time")
    parser.add_argument(
        "--limit", type=float, default=600.0, help="seconds (wall clock) for a unit's diagnosis"
    )
    parser.add_argument("--scenario", type=Path, default=ROOT / "scenarios" / "driven.toml")
    options = parser.parse_args()
    folder = options.output.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    units = plan(options.effect or list(CATALOGUE), options.units, options.clean, options.seed)
    found: list[Discovery] = []
    with ProcessPoolExecutor(options.jobs, multiprocessing.get_context("spawn")) as pool:
        waiting = [
            pool.submit(run, unit, folder, options.scenario.resolve(), options.limit) for unit in units
        ]
        for ended in waiting:
            found.append(ended.result())
            print(summary(found[-1:]).splitlines()[1], flush=True)
    print(text := summary(found))
    (folder / "summary.txt").write_text(text + "\n")


if __name__ == "__main__":
    main()
