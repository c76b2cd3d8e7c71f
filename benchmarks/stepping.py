"""Free steps against steps from sample to sample on every shipped scenario: CPU, errors, events, side by side.

    python benchmarks/stepping.py [--only motor,driven]

Each recording of a scenario (each condition of a tuning) runs on the scenario's FMU with its own tolerance, in turns:
freely, and communicating at every sample. Errors are the largest deviation of any signal in any sample from a run at
1e-9 that communicates at every sample, in standard deviations of the noise that the scenario states or the recording
shows, whichever is larger; below the band that a scenario compares a signal in. The sensors of a tuning have
``SIGMA``. ``others`` is the largest error of the signals that no sensor measures, over their range. CPU seconds are
those of ``Plant.run``, medians. The exit code is 1 where a free run is more than ``--limit`` standard deviations off.
"""

import argparse
import ctypes
import statistics
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from thsa_cosim.batch import Experiment
from thsa_cosim.errors import ThsaCosimError
from thsa_cosim.fmu import Plant
from thsa_cosim.fmu.fmi2 import Fmi2Instance
from thsa_cosim.inverse_dynamics import low_pass
from thsa_cosim.scenario import StagedScenario, TuneScenario, load
from thsa_cosim.signals import Signals
from thsa_cosim.simulate import _cases
from thsa_cosim.system import SystemPlant
from thsa_cosim.tune.problem import build_groups

SCENARIOS = Path(__file__).parent.parent / "scenarios"
EMPS = SCENARIOS.parent.parent / "shared" / "emps" / "DATA_EMPS.mat"
SIGMA = {"v": 2e-5, "x": 1e-6, "w_m": 0.2, "i_q": 0.05, "u_q": 0.3, "F": 60.0}
FIRST = ("motor", "gearbox", "screw", "driven", "driven_check", "table4")
SHIPPED = (*FIRST, *sorted({path.stem for path in SCENARIOS.glob("*.toml")} - set(FIRST)))


class Talking(Fmi2Instance):
    """An instance that logs its events."""

    def instantiate(self) -> None:
        """Instantiate, then switch every category on."""
        super().instantiate()
        self.call("SetDebugLogging", (ctypes.c_int, 1), (ctypes.c_size_t, 0), (ctypes.c_void_p, None))


@dataclass(frozen=True)
class Seen:
    """What a sensor sees of its signal: noise in the signal's unit, and the band in Hz that is compared."""

    noise: float
    band: float | None = None


def experiments(name: str) -> Iterator[tuple[Experiment, Mapping[str, Seen]]]:
    """What a scenario simulates, with the noise of what it records; of stages what each of them does."""
    given = {"fit": [EMPS]} if name.startswith("emps") else {}
    study = load(SCENARIOS / f"{name}.toml", **given)
    rig = {signal: Seen(sigma) for signal, sigma in SIGMA.items()}
    for part in [s.scenario for s in study.stages] if isinstance(study, StagedScenario) else [study]:
        if isinstance(part, TuneScenario):
            for case in build_groups(part)[0].cases:
                yield case.experiment, rig
            continue
        for recording, _, experiment in _cases(part):
            shown = {n: Seen(sigma) for n, sigma in recording.noise.items() if sigma > 0.0}
            stated = {
                n: Seen(
                    max(part.noise(recording, n), recording.noise[n] if table.band is None else 0.0),
                    table.band,
                )
                for n, table in part.cost.channels.items()
            }
            yield experiment, rig | shown | stated


def opened(experiment: Experiment, stepping: str, **further: object) -> Plant:
    """The experiment's FMU, or system of FMUs."""
    kind = SystemPlant if experiment.fmu.suffix == ".ssp" else Plant
    return kind.open(experiment.fmu, stepping=stepping, **further)


def events(experiment: Experiment, stepping: str) -> int | None:
    """Changes of relations in one run; None for a system, whose components say nothing."""
    if experiment.fmu.suffix == ".ssp":
        return None
    lines: list[str] = []
    with opened(experiment, stepping, on_message=lines.append) as plant:
        plant._instance = Talking(plant.folder, plant.description, plant.kind, lines.append)
        run(plant, experiment)
    return sum("event at time" in line for line in lines)


def run(plant: Plant, experiment: Experiment, tolerance: float | None = None) -> Signals:
    """One run; ``tolerance`` replaces the experiment's."""
    return plant.run(
        experiment.fixed,
        experiment.inputs,
        experiment.outputs,
        experiment.time,
        tolerance=tolerance or experiment.tolerance,
    )


@dataclass(frozen=True)
class Ran:
    """CPU seconds of a way to step, its largest error in standard deviations, and that of other signals over range."""

    seconds: float
    error: float
    others: float


def compare(experiment: Experiment, sensors: Mapping[str, Seen], turns: int) -> tuple[Ran, Ran]:
    """One experiment by samples, and freely."""
    with opened(experiment, "samples") as stepped, opened(experiment, "free") as free:
        reference = run(stepped, experiment, 1e-9)
        seconds = defaultdict(list)
        worst = {
            plant: largest_errors(run(plant, experiment), reference, sensors) for plant in (stepped, free)
        }
        for _ in range(turns):
            for plant in (stepped, free):
                begin = time.thread_time()
                run(plant, experiment)
                seconds[plant].append(time.thread_time() - begin)
        return tuple(Ran(statistics.median(seconds[p]), *worst[p]) for p in (stepped, free))


def largest_errors(found: Signals, reference: Signals, sensors: Mapping[str, Seen]) -> tuple[float, float]:
    """The largest deviation of what sensors see, in standard deviations, and that of other signals over range."""
    seen, others = 0.0, 0.0
    step = float(np.mean(np.diff(reference.time)))
    for name in reference.names:
        off, sensor = found[name] - reference[name], sensors.get(name)
        if sensor is None:
            others = max(others, float(abs(off).max() / (np.ptp(reference[name]) or 1.0)))
            continue
        if sensor.band is not None:
            off = low_pass(off, sensor.band, step)
        seen = max(seen, float(abs(off).max()) / sensor.noise)
    return seen, others


def line(name: str, turns: int, limit: float) -> tuple[str, bool]:
    """The scenario's line, and whether its free runs keep the limit."""
    try:
        found = list(experiments(name))
        rows = [compare(e, sensors, turns) for e, sensors in found]
        counts = [[events(e, stepping) for e, _ in found] for stepping in ("free", "samples")]
    except ThsaCosimError as error:
        return f"{name:20s} left out: {error}", True
    if not rows:
        return f"{name:20s} left out: it simulates nothing", True
    stepped, free = (sum(row[k].seconds for row in rows) for k in (0, 1))
    each = 1e3 / len(rows)
    said = ["-" if None in own else str(sum(own)) for own in counts]
    by_samples, error = (max(row[k].error for row in rows) for k in (0, 1))
    others = max(row[1].others for row in rows)
    return (
        f"{name:20s} {len(rows):4d} {each * stepped:11.2f} {each * free:10.2f} {stepped / free:7.1f}"
        f"   {error:.1e} ({by_samples:.1e})  {others:.1e}    {said[0]} ({said[1]})"
        + ("" if error <= limit else f"   above {limit:g}"),
        error <= limit,
    )


def main() -> int:
    """Run and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", default="", help="scenarios by name, with commas between")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--limit", type=float, default=0.01, help="standard deviations")
    options = parser.parse_args()
    print(
        f"{'scenario':20s} runs  samples ms    free ms   ratio   error/sigma (samples)   others     events (samples)"
    )
    kept = []
    for name in [name for name in options.only.split(",") if name] or SHIPPED:
        text, keeps = line(name, options.turns, options.limit)
        print(text, flush=True)
        kept.append(keeps)
    return int(not all(kept))


if __name__ == "__main__":
    sys.exit(main())
