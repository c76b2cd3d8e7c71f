"""Does one more recording, planned by the diagnosis, leave no tie?

    python benchmarks/blind_next.py [--units 30] [--seed 1] [--jobs 2] [-o FILE.jsonl]

A bench in closed form: a motor with its declared resistance, torque constant, Coulomb and viscous friction, an effect
at a random place of its range, sensors with white noise. Every unit was recorded too poorly: its speeds lie in a
narrow band, one way or both, its load hardly changes. Units whose diagnosis ends with a tie are kept until there are
enough. For each the next experiment is planned within the rig's limits, "recorded" from the true drive, and fitted in
addition, as `thsa-cosim diagnose --next` and `--with` do. Printed: ties before and after, whether the first name is
the true one, and what was expected of the profile; of the units without a tie, whether theirs is. Goal: no tie left in
90 %. With `-o` the file keeps a line a unit, and the same command goes on where it was stopped. The units, and those
that count, are the same whatever `--jobs` says.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.stats import binomtest

from thsa_cosim.batch import Experiment, Job, Outcome, Status
from thsa_cosim.costs.channels import Channel
from thsa_cosim.diagnosis.catalogue.candidate import Candidate, candidates_of
from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.diagnosis.catalogue.slots import Slot
from thsa_cosim.diagnosis.choosing.attribution import Attribution, attribute
from thsa_cosim.diagnosis.choosing.score import held_shapes
from thsa_cosim.diagnosis.explaining.experiment import separating_experiment
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns
from thsa_cosim.diagnosis.results import SeparatingExperiment
from thsa_cosim.scenario.diagnose_schema import LimitsTable
from thsa_cosim.signals import Signals
from thsa_cosim.study import Case

TIME = np.arange(1601) * 5e-3
NOISE = {"i": 0.02, "u": 0.05}
SPEED, LOAD, RATE = 28.0, 3.0, 200.0  # rad/s, N.m, rad/s2: what the rig can do
DECLARED = {"R": 1.5, "K": 0.2, "c": 0.4, "b": 0.01}
PLACE = Slot("motor", "FrictionEffect", {"v": "rad/s", "z": "rad", "N": "N.m", "F": "N.m"})
SCALES = {"motor": {"V": SPEED, "Z": 60.0, "D": 200.0, "W": 1.0, "F": 2.0}}
EFFECTS = (
    "stribeck",
    "windage",
    "shear-thinning",
    "load-dependent-friction",
    "asymmetric-friction",
    "friction-run-in",
)
LIMITS = LimitsTable(
    time=8.0, range={"v": (-SPEED, SPEED), "N": (-LOAD, LOAD)}, rate={"v": RATE, "N": 20.0}, travel=100.0
)


@dataclass
class Drive:
    """Runs jobs in closed form under the inputs of its experiments, by name."""

    candidates: tuple[Candidate, ...]
    inputs: Mapping[str, Signals]
    measured: Mapping[str, Mapping[str, np.ndarray]]
    notes: tuple[str, ...] = ()

    def __enter__(self) -> Drive:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def outputs(self, values: Mapping[str, float], inputs: Signals) -> dict[str, np.ndarray]:
        v, load = inputs["v"], inputs["N"]
        z = np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(inputs.time))])
        at = {"time": inputs.time, "v": v, "s": np.tanh(v / 0.01), "z": z, "N": load}
        torque = values["c"] * at["s"] + values["b"] * v + load
        for candidate in {c.component: c for c in self.candidates}.values():
            assert candidate.variant.law is not None
            prefix = f"motor.{candidate.component}"
            starts = {p.name: p.at_start for p in candidate.all_parameters}
            given = {n: values.get(f"motorEffect.{prefix[6:]}.{n}", start) for n, start in starts.items()}
            torque = torque + candidate.variant.law(given, at)
        return {"i": torque / values["K"], "u": values["R"] * torque / values["K"] + values["K"] * v}

    def run(self, jobs: Sequence[Job], on_outcome: Any = None) -> list[Outcome]:
        outcomes = []
        for index, job in enumerate(jobs):
            found = self.outputs({**DECLARED, **job.values}, self.inputs[job.experiment])
            if job.keep_signals:
                signals = Signals(self.inputs[job.experiment].time, found)
                outcomes.append(Outcome(Status.OK, "", signals, None, 0.0, ""))
            else:
                measured = self.measured[job.experiment]
                residual = np.concatenate([(found[n] - measured[n]) / NOISE[n] for n in NOISE])
                outcomes.append(Outcome(Status.OK, "", None, residual, 0.0, ""))
            if on_outcome is not None:
                on_outcome(index, outcomes[-1])
        return outcomes

    def close(self) -> None:
        pass


class Unit:
    """A drive off its drawing with an effect, and its recordings."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        random = self.random
        effects = [known_effects()[name] for name in EFFECTS]
        self.candidates = candidates_of(effects, (PLACE,), SCALES)
        self.effect = EFFECTS[seed % len(EFFECTS)]
        own = [c for c in self.candidates if c.effect.name == self.effect and not c.variant.beside]
        candidate = own[int(random.integers(len(own)))]
        self.truth = {n: v * (1.0 + 0.03 * random.normal()) for n, v in DECLARED.items()}
        for p in candidate.parameters:
            if p.role == "coefficient":
                self.truth[p.variable] = p.neutral + p.typical * random.uniform(3.0, 12.0)
            elif not p.fixed:
                low, high = np.log([max(p.lower, 0.3 * p.starts[0]), min(p.upper, 3.0 * p.starts[-1])])
                self.truth[p.variable] = float(np.exp(random.uniform(low, high)))
        self.truth = {**held_shapes(self.candidates), **self.truth}
        self.middle, self.width = random.uniform(0.3, 0.8) * SPEED, random.uniform(0.01, 0.1) * SPEED
        self.both_ways, self.swing = random.random() < 0.5, float(random.choice([0.0, 0.05])) * LOAD
        self.drive = Drive(self.candidates, {}, {})
        self.recordings = {f"{part}/{part}_1": self.record(self.poor()) for part in ("fit", "validate")}

    def poor(self) -> Signals:
        """A narrow band of speeds, one way or both, under a load that hardly changes."""
        turn = self.random.uniform(0.0, 2.0 * np.pi)
        speed = self.middle + self.width * np.sin(2.0 * np.pi * 0.7 * TIME + turn)
        way = np.clip(20.0 * np.sin(2.0 * np.pi * 0.4 * TIME + 0.3 * turn), -1.0, 1.0)
        if not self.both_ways:
            way = np.clip(TIME, 0.0, 1.0)
        load = 0.4 * LOAD + self.swing * np.sin(1.1 * TIME + turn)
        return Signals(TIME, {"v": speed * way, "N": load}, {"v": "rad/s", "N": "N.m"})

    def record(self, inputs: Signals) -> tuple[Signals, dict[str, np.ndarray]]:
        """What the sensors make of the true drive."""
        true = self.drive.outputs(self.truth, inputs)
        return inputs, {n: y + NOISE[n] * self.random.standard_normal(y.size) for n, y in true.items()}

    def diagnosed(self) -> tuple[Attribution, Bench]:
        """The diagnosis of the recordings so far."""
        inputs = {name: own for name, (own, _) in self.recordings.items()}
        measured = {name: own for name, (_, own) in self.recordings.items()}
        drive = Drive(self.candidates, inputs, measured)
        bench = Bench(drive, [self._trial(n) for n in self.recordings], held_shapes(self.candidates))  # type: ignore[arg-type]
        found = attribute(bench, _declared(), self.candidates, lambda _: {}, seed=1, most=1)
        assert found is not None
        return found, bench

    def _trial(self, name: str) -> Trial:
        inputs, measured = self.recordings[name]
        part, own = name.split("/")
        channels = tuple(Channel(n, inputs.time, measured[n], NOISE[n]) for n in NOISE)
        empty = Signals(inputs.time, {})
        case = Case(own, Path("x.fmu"), inputs, inputs.time, {}, channels, empty, 20.0, None)
        return Trial(case, part, "all")  # type: ignore[arg-type]

    def planned(self, found: Attribution, bench: Bench) -> SeparatingExperiment | None:
        """The next experiment within the rig's limits."""

        def open_runner(_: Any, experiments: Sequence[Experiment]) -> Drive:
            return Drive(self.candidates, {e.name: e.inputs for e in experiments if e.inputs is not None}, {})

        limits = LIMITS.model_copy(update={"range": {**LIMITS.range, "i": (-1e3, 1e3), "u": (-1e3, 1e3)}})
        scenario: Any = SimpleNamespace(simulation=None)
        spec: Any = SimpleNamespace(command="v", load="N", limits=limits)
        return separating_experiment(scenario, spec, found, bench.trials, {}, open_runner)  # type: ignore[arg-type]


def _declared() -> Unknowns:
    members = [Unknown(n, n, "1", v, 0.1 * v, 0.1 * v, 0.1 * v, 10.0 * v) for n, v in DECLARED.items()]
    return Unknowns(tuple(members))


def ties(found: Attribution) -> tuple[str, tuple[str, ...]]:
    """The first name and what is tied with it; "" where nothing was accepted."""
    if not found.accepted:
        return "", ()
    one = next(r for r in found.rounds if r.accepted is not None)
    assert one.accepted is not None
    return one.accepted.candidate.effect.name, tuple(r.candidate.effect.name for r in one.rivals)


@dataclass(frozen=True)
class Row:
    """What became of a unit: names first and tied, before and after the next recording; ``cpu`` in s."""

    number: int
    effect: str
    before: list[str]
    after: list[str]
    profile: str
    sigmas: float
    separates: bool
    cpu: float

    @property
    def tied(self) -> bool:
        """Whether it counts."""
        return len(self.before) > 1

    @property
    def settled(self) -> bool:
        """Whether the next recording left one name."""
        return len(self.after) == 1

    def __str__(self) -> str:
        what = f"{self.profile}, {self.sigmas:.0f} sigma" if self.profile else "no profile"
        return f"{self.effect:24s} {' = '.join(self.before)} -> {' = '.join(self.after) or 'none'}  [{what}]"


def tried(seed: int, number: int) -> Row:
    """One unit from its first diagnosis to the one with the next recording."""
    begin = time.process_time()
    unit = Unit(seed * 100_000 + number)
    found, bench = unit.diagnosed()
    before = after = _names(found)
    best = unit.planned(found, bench) if len(before) > 1 else None
    if best is not None:
        unit.recordings["fit/next"] = unit.record(best.inputs)
        after = _names(unit.diagnosed()[0])
    return Row(
        number,
        unit.effect,
        before,
        after,
        "" if best is None else best.name,
        0.0 if best is None else best.expected**0.5,
        best is not None and best.separates,
        round(time.process_time() - begin, 2),
    )


def _names(found: Attribution) -> list[str]:
    first, rivals = ties(found)
    return [first, *rivals] if first else []


def rows(seed: int, most: int, jobs: int, known: Mapping[int, Row]) -> Iterator[Row]:
    """One unit after the other, in their order, `jobs` at a time; what is ``known`` is not run again."""
    with ProcessPoolExecutor(jobs) as pool:
        for first in range(0, most, 8 * jobs):
            numbers = range(first, min(most, first + 8 * jobs))
            asked = {n: pool.submit(tried, seed, n) for n in numbers if n not in known}
            try:
                yield from (known[n] if n in known else asked[n].result() for n in numbers)
            finally:
                for future in asked.values():
                    future.cancel()


def summary(seen: Sequence[Row]) -> str:
    """Counts with exact binomial intervals."""
    tied = [r for r in seen if r.tied]
    alone = [r for r in seen if len(r.before) == 1]
    counted = [
        ("no tie left (goal: 0.90)", [r.settled for r in tied]),
        ("... and the true one", [r.after == [r.effect] for r in tied]),
        ("the true one first", [r.after[:1] == [r.effect] for r in tied]),
        ("no tie where expected", [r.settled for r in tied if r.separates]),
        ("never tied: the true one", [r.before == [r.effect] for r in alone]),
    ]
    lines = []
    for text, held in counted:
        if held:
            interval = binomtest(sum(held), len(held)).proportion_ci(method="exact")
            lines.append(
                f"{text:26s} {sum(held)} of {len(held)}  ({interval.low:.2f} .. {interval.high:.2f})"
            )
    cpu = sum(r.cpu for r in seen)
    lines.append(
        f"{len(seen)} units looked at, {cpu:.0f} CPU s, {cpu / max(1, len(tied)):.1f} CPU s a tied unit"
    )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--units", type=int, default=30, help="tied units")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="units at a time")
    parser.add_argument("-o", "--output", type=Path, help="file of results to write, or to continue")
    options = parser.parse_args()
    known: dict[int, Row] = {}
    if options.output is not None and options.output.exists():
        head, *lines = options.output.read_text().splitlines()
        if json.loads(head) != {"seed": options.seed}:
            parser.error(f"{options.output} was begun with another seed: {head}")
        known = {r.number: r for r in (Row(**json.loads(line)) for line in lines)}
    elif options.output is not None:
        options.output.write_text(json.dumps({"seed": options.seed}) + "\n")
    seen: list[Row] = []
    tied = 0
    for row in rows(options.seed, 200 * options.units, options.jobs, known):
        seen.append(row)
        if options.output is not None and row.number not in known:
            with options.output.open("a") as file:
                file.write(json.dumps(asdict(row)) + "\n")
        if row.tied:
            tied += 1
            print(f"{tied:3d} of {options.units}  {row}", flush=True)
        elif len(seen) % 100 == 0:
            print(f"    {len(seen)} units looked at", flush=True)
        if tied == options.units:
            break
    print(summary(seen))


if __name__ == "__main__":
    main()
