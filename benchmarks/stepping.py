"""Free steps against steps from sample to sample on every shipped scenario: CPU, errors, events, side by side.

    python benchmarks/stepping.py [--only motor,driven]

Each recording of a scenario (each condition of a tuning) runs on the scenario's FMU with its own tolerance, in turns:
freely, and communicating at every sample. Errors are the largest deviation of any signal in any sample from a run at
1e-9 that communicates at every sample, in standard deviations of the rig's sensors (``SIGMA``; of other signals, those
that the recording's noise has). CPU seconds are those of ``Plant.run``, medians.
"""

import argparse
import ctypes
import statistics
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

from thsa_cosim.batch import Experiment
from thsa_cosim.errors import ThsaCosimError
from thsa_cosim.fmu import Plant
from thsa_cosim.fmu.fmi2 import Fmi2Instance
from thsa_cosim.scenario import Scenario, TuneScenario, load
from thsa_cosim.signals import Signals
from thsa_cosim.simulate import _cases
from thsa_cosim.tune.problem import build_groups

SCENARIOS = Path(__file__).parent.parent / "scenarios"
EMPS = SCENARIOS.parent.parent / "shared" / "emps" / "DATA_EMPS.mat"
SIGMA = {"v": 2e-5, "x": 1e-6, "w_m": 0.2, "i_q": 0.05, "u_q": 0.3, "F": 60.0}
KINDS = {
    "identify": ("motor", "gearbox", "screw", "driven", "driven_check", "emps"),
    "tune": ("table4", "schedule", "feedforward"),
}


class Talking(Fmi2Instance):
    """An instance that logs its events."""

    def instantiate(self) -> None:
        """Instantiate, then switch every category on."""
        super().instantiate()
        self.call("SetDebugLogging", (ctypes.c_int, 1), (ctypes.c_size_t, 0), (ctypes.c_void_p, None))


def experiments(kind: str, name: str) -> Iterator[tuple[Experiment, Mapping[str, float]]]:
    """What a scenario simulates, with the noise of what it records."""
    path = SCENARIOS / f"{name}.toml"
    if kind == "tune":
        for case in build_groups(load(path, TuneScenario))[0].cases:
            yield case.experiment, SIGMA
        return
    fit = {"fit": [EMPS]} if name == "emps" else {}
    for recording, _, experiment in _cases(load(path, Scenario, **fit)):
        yield experiment, {**recording.noise, **SIGMA}


def events(experiment: Experiment, stepping: str) -> int:
    """Changes of relations in one run."""
    lines: list[str] = []
    with Plant.open(experiment.fmu, stepping=stepping, on_message=lines.append) as plant:
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


def compare(
    experiment: Experiment, noise: Mapping[str, float], turns: int
) -> tuple[float, float, float, float]:
    """CPU seconds by samples and freely, and the largest error of each in standard deviations."""
    with (
        Plant.open(experiment.fmu, stepping="samples") as stepped,
        Plant.open(experiment.fmu, stepping="free") as free,
    ):
        reference = run(stepped, experiment, 1e-9)
        seconds = defaultdict(list)
        worst = []
        for plant in (stepped, free):
            found = run(plant, experiment)
            shown = [n for n in found.names if noise.get(n)]
            worst.append(
                max((float(abs(found[n] - reference[n]).max()) / noise[n] for n in shown), default=0.0)
            )
        for _ in range(turns):
            for plant in (stepped, free):
                begin = time.thread_time()
                run(plant, experiment)
                seconds[plant].append(time.thread_time() - begin)
    return statistics.median(seconds[stepped]), statistics.median(seconds[free]), worst[0], worst[1]


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="scenarios by name, with commas between")
    parser.add_argument("--turns", type=int, default=5)
    options = parser.parse_args()
    chosen = [name for name in options.only.split(",") if name]
    print("scenario       runs  samples ms    free ms   ratio   error/sigma (samples)   events (samples)")
    for kind, names in KINDS.items():
        for name in names:
            if chosen and name not in chosen:
                continue
            try:
                found = list(experiments(kind, name))
            except ThsaCosimError as error:
                print(f"{name:14s} left out: {error}")
                continue
            rows = [compare(e, noise, options.turns) for e, noise in found]
            counts = [sum(events(e, stepping) for e, _ in found) for stepping in ("free", "samples")]
            stepped, free = (sum(row[k] for row in rows) / len(rows) for k in (0, 1))
            print(
                f"{name:14s} {len(rows):4d} {1e3 * stepped:11.2f} {1e3 * free:10.2f} {stepped / free:7.1f}"
                f"   {max(r[3] for r in rows):.1e} ({max(r[2] for r in rows):.1e})     {counts[0]} ({counts[1]})",
                flush=True,
            )


if __name__ == "__main__":
    main()
