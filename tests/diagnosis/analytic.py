"""A drive in closed form that a diagnosis can be run on without an FMU: a motor, a rigid gear, a load behind it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from thsa_cosim.batch import Job, Outcome, Status
from thsa_cosim.batch.runner import OnOutcome
from thsa_cosim.costs.channels import Channel
from thsa_cosim.diagnosis.catalogue.candidate import Candidate, candidates_of
from thsa_cosim.diagnosis.catalogue.effect import Effect
from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.diagnosis.catalogue.slots import Slot
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns
from thsa_cosim.signals import Signals
from thsa_cosim.study import Case

TIME = np.arange(1601) * 5e-3
NOISE = {"i": 0.02, "u": 0.05}
RATIO = 30.0
#: A motor behind whose rigid gear a friction is the same, and a nut whose friction the load's clutch multiplies.
MOTOR = Slot("motor", "FrictionEffect", {"v": "rad/s", "z": "rad", "N": "N.m", "F": "N.m"})
GEAR = Slot("gear", "FrictionEffect", {"v": "rad/s", "z": "rad", "N": "N.m", "F": "N.m"})
SCALES = {
    "motor": {"V": 30.0, "Z": 60.0, "D": 200.0, "W": 1.0, "F": 2.0},
    "gear": {"V": 1.0, "Z": 2.0, "D": 7.0, "W": 1.0, "F": 60.0},
}
DECLARED = {"R": 1.5, "K": 0.2, "c": 0.4, "b": 0.01}
PHASE = {"fit": 0.0, "validate": 1.1}


@cache
def motion(part: str) -> dict[str, np.ndarray]:
    """Speed, position and load at the motor: up, down, to rest, at several speeds."""
    turn = PHASE[part]
    v = 18.0 * np.sin(1.3 * TIME + turn) + 10.0 * np.sin(3.1 * TIME + 2.0 * turn)
    z = -18.0 / 1.3 * np.cos(1.3 * TIME + turn) - 10.0 / 3.1 * np.cos(3.1 * TIME + 2.0 * turn)
    load = 2.0 * np.sin(0.9 * TIME + 0.3 + turn)
    return {"time": TIME, "v": v, "s": np.sign(v), "z": z, "N": load}


def at(slot: Slot, part: str) -> dict[str, np.ndarray]:
    """What a block reads in a slot."""
    own = motion(part)
    if slot is MOTOR:
        return own
    return own | {"v": own["v"] / RATIO, "z": own["z"] / RATIO, "N": own["N"] * RATIO}


@dataclass
class Drive:
    """The outputs under start values, effects included; runs jobs as a `Runner` does."""

    candidates: tuple[Candidate, ...]
    measured: Mapping[str, Mapping[str, np.ndarray]]
    ran: list[Job] = field(default_factory=list)
    notes: tuple[str, ...] = ()

    def outputs(self, values: Mapping[str, float], part: str) -> dict[str, np.ndarray]:
        own = motion(part)
        current = values["c"] * own["s"] + values["b"] * own["v"] + own["N"]
        blocks = {f"{c.slot.component}.{c.component}": c for c in self.candidates}
        for prefix, candidate in blocks.items():
            law = candidate.variant.law
            assert law is not None
            starts = {p.name: p.at_start for p in candidate.all_parameters}
            given = {n: values.get(f"{prefix}.{n}", start) for n, start in starts.items()}
            force = law(given, at(candidate.slot, part))
            current = current + (force if candidate.slot is MOTOR else force / RATIO)
        return {"i": current, "u": values["R"] * current + values["K"] * own["v"]}

    def run(self, jobs: Sequence[Job], on_outcome: OnOutcome | None = None) -> list[Outcome]:
        self.ran += jobs
        outcomes = []
        for job in jobs:
            part = job.experiment.split("/")[0]
            found = self.outputs(job.values, part)
            residual = [(found[n] - self.measured[part][n]) / NOISE[n] for n in NOISE]
            outcomes.append(Outcome(Status.OK, "", None, np.concatenate(residual), 0.0, ""))
        for index, outcome in enumerate(outcomes):
            if on_outcome is not None:
                on_outcome(index, outcome)
        return outcomes

    def close(self) -> None:
        pass


@cache
def candidates(*names: str) -> tuple[Candidate, ...]:
    """Candidates of the named effects at the motor and behind its gear."""
    known: dict[str, Effect] = known_effects()
    return candidates_of([known[name] for name in names], (MOTOR, GEAR), SCALES)


def bench(
    offered: tuple[Candidate, ...],
    true: Mapping[str, float],
    seed: int = 3,
    fixed: Mapping[str, float] | None = None,
) -> Bench:
    """Recordings of a drive with the ``true`` effects, and a bench that offers candidates."""
    generator = np.random.default_rng(seed)
    drive = Drive(offered, {})
    drive.measured = {
        part: {
            name: signal + NOISE[name] * generator.standard_normal(TIME.size)
            for name, signal in drive.outputs({**DECLARED, **true}, part).items()
        }
        for part in PHASE
    }
    return Bench(drive, [_trial(drive, part) for part in PHASE], fixed)  # type: ignore[arg-type]


def _trial(drive: Drive, part: str) -> Trial:
    channels = tuple(Channel(n, TIME, drive.measured[part][n], NOISE[n]) for n in NOISE)
    empty = Signals(TIME, {})
    case = Case(part, Path("x.fmu"), empty, TIME, {}, channels, empty, 20.0, None)
    return Trial(case, part, "all")  # type: ignore[arg-type]


def unknowns(**changes: Mapping[str, float]) -> Unknowns:
    """The declared parameters from the drawing, a few percent off; ``changes`` by name."""
    members = []
    for name, value in DECLARED.items():
        given = {"start": 1.03 * value, "lower": 0.1 * value, "upper": 10.0 * value, "spread": 0.1 * value}
        given |= changes.get(name, {})
        members.append(Unknown(name, name, "1", scale=0.1 * value, **given))
    return Unknowns(tuple(members))
