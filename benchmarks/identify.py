"""Our identification against AixCaliBuHA (PyPI), on the same FMU, recording, channels, bounds and DE settings.

    python benchmarks/identify.py [RECORDING] [--workers 2] [--seconds 900] [--environment DIR]

One motor recording at one temperature; four parameters; currents and voltages in units of their noise (eq. 6).
AixCaliBuHA gets a virtual environment of its own (made once, cached), FMU_API, Goals with the measure MSE and
weights 1/noise^2, and SciPy's differential evolution as it passes it on: S = 45, G = 30, F = 0.16, CR = 0.5,
rand1bin, its own polish (L-BFGS-B) and the same first population. Ours runs before and after it. Prints

    vs_aixcalibuha          (its time to the lowest cost that it finds) / (our mean time to that cost)
    vs_aixcalibuha_linear   the same with our log-scaled bounds made linear, as AixCaliBuHA has no others
    cpu_per_run             its processor time per simulation / ours, everything included
    error_...               of each parameter in percent of the rig's declared law, for both, and what ours states

What differs: AixCaliBuHA gives SciPy's DE one process (ours --workers), updates the population at once where we
update it per generation, steps the FMU in Python and resets one instance where we make a new one per run. fmpy
records outputs before it sets the input of that instant, so its u_q lags a moving command by a sample, which alone
moved its R_s by 19 %: samples at which the command moves count for neither side, so that both minimise one cost.
Time counts from opening the FMU, without imports. With --seconds over before its search is, the ratio is
still for the lowest cost that it had found by then, and the line says so.
"""

import argparse
import json
import os
import resource
import subprocess
import tempfile
import time
import venv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from thsa_cosim.batch import Job, LocalRunner
from thsa_cosim.costs import TermsReducer
from thsa_cosim.identify import identify
from thsa_cosim.identify.problem import build_point
from thsa_cosim.laws import published_law
from thsa_cosim.parameters import ParameterSpace
from thsa_cosim.scenario import Executor, Scenario, load
from thsa_cosim.search import EvolutionSettings
from thsa_cosim.search.differential_evolution import initial_population
from thsa_cosim.study import Place, Progress

PINNED = ("aixcalibuha==1.2.0", "ebcpy==0.8.0", "fmpy==0.3.32", "scipy==1.17.1", "pandas==2.3.3")
HERE = Path(__file__).resolve().parent
CHANNELS = ("i_q", "u_q")
SCENARIO = HERE.parent / "scenarios" / "motor.toml"
RECORDING = HERE.parent / "scenarios" / "recordings" / "motor_m30.parquet"
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "thsa-cosim"


@dataclass(frozen=True)
class Trail:
    """Seconds and lowest cost per sample at every improvement; what was found, and what it took."""

    seconds: np.ndarray
    costs: np.ndarray
    values: dict[str, float]
    stderr: dict[str, float]
    total: float
    cpu: float
    runs: int

    def time_to(self, cost: float) -> float:
        """Seconds until a cost at or below ``cost`` was found, infinite if never."""
        reached = self.seconds[self.costs <= cost]
        return float(reached[0]) if reached.size else float("inf")


def spans(chosen: np.ndarray, time: np.ndarray) -> list[tuple[float, float]]:
    """First and last time of every run of ``chosen`` samples, a quarter of a sample wider on both sides."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]])))
    margin = 0.25 * float(np.min(np.diff(time)))
    return [(time[a] - margin, time[b - 1] + margin) for a, b in edges.reshape(-1, 2)]


def moving(scenario: Scenario) -> np.ndarray:
    """Samples at which the command differs from the one before."""
    command = scenario.fit[0].signals["w_cmd"]
    return np.concatenate([[False], np.diff(command) != 0.0])


def scenario_of(recording: Path, *, linear: bool) -> Scenario:
    """The motor scenario: one recording, two channels, steady commands; its bounds linear on request."""
    scenario = load(SCENARIO, Scenario, fit=[recording])
    scenario = replace(
        scenario,
        search=scenario.search.model_copy(update={"method": "differential-evolution"}),
        cost=scenario.cost.model_copy(
            update={
                "channels": {name: scenario.cost.channels[name] for name in CHANNELS},
                "mask": [list(span) for span in spans(moving(scenario), scenario.fit[0].signals.time)],
            }
        ),
    )
    if not linear:
        return scenario
    space = ParameterSpace(tuple(replace(p, scale="linear") for p in scenario.parameters.parameters))
    points = tuple(replace(point, space=space) for point in scenario.points)
    return replace(scenario, parameters=space, points=points)


def cpu_seconds() -> float:
    """Processor time of this process and of its children that have ended."""
    both = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in both)


def run_ours(recording: Path, workers: int, *, linear: bool) -> Trail:
    """One identification into a temporary folder."""
    seconds, costs = [], []
    busy, begin = cpu_seconds(), time.perf_counter()

    def note(progress: Progress) -> None:
        if progress.best and (not costs or min(progress.best.values()) < costs[-1]):
            seconds.append(time.perf_counter() - begin)
            costs.append(min(progress.best.values()))

    with tempfile.TemporaryDirectory() as folder:
        scenario = scenario_of(recording, linear=linear)
        result = identify(scenario, Place(Path(folder) / "study", Executor(workers), note))
    total = time.perf_counter() - begin
    found = result.points[0].parameters
    return Trail(
        np.array(seconds),
        np.array(costs),
        {name: estimate.value for name, estimate in found.items()},
        {name: estimate.stderr or np.nan for name, estimate in found.items()},
        total,
        cpu_seconds() - busy,
        result.evaluations,
    )


def environment(folder: Path) -> Path:
    """The Python of an environment with AixCaliBuHA; made if it is not there yet."""
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    done = folder / "installed.txt"
    if not done.exists() or done.read_text() != "\n".join(PINNED):
        print(f"# making {folder}", flush=True)
        venv.create(folder, with_pip=True, clear=True)
        install = [python, "-m", "pip", "install", "--quiet", *PINNED]
        made = subprocess.run(install, capture_output=True, text=True, timeout=1200, check=False)
        if made.returncode:
            raise SystemExit(f"AixCaliBuHA cannot be installed: {made.stderr.strip()[-2000:]}")
        done.write_text("\n".join(PINNED))
    return python


def run_theirs(
    recording: Path, python: Path, seconds: float, probe: dict[str, float]
) -> tuple[Trail, bool, float]:
    """AixCaliBuHA's calibration in its own process, whether it came to its end, and its cost at ``probe``."""
    scenario = scenario_of(recording, linear=True)
    measured, point, search = scenario.fit[0], scenario.points[0], scenario.search
    settings = EvolutionSettings(population=search.population, seed=scenario.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        table = {"time": np.round(measured.signals.time, 9)}
        table |= {n: measured.signals[n] for n in measured.signals.names}
        pd.DataFrame(table).to_parquet(folder / "data.parquet")
        problem = {
            "fmu": str(scenario.fmu.path.resolve()),
            "data": str(folder / "data.parquet"),
            "folder": name,
            "log": str(folder / "log.jsonl"),
            "inputs": list(scenario.inputs),
            "noise": {n: scenario.noise(measured, n) for n in CHANNELS},
            "fixed": dict(point.fixed),
            "parameters": [
                {"variable": p.variable, "lower": p.lower, "upper": p.upper} for p in point.space.parameters
            ],
            "seconds": seconds,
            "intervals": spans(~moving(scenario), measured.signals.time),
            "probe": [probe[p.name] for p in point.space.parameters],
            "search": {
                "strategy": search.strategy,
                "generations": search.generations,
                "mutation": search.mutation,
                "crossover": search.crossover,
                "seed": scenario.seed,
                "population": initial_population(point.space.dimension, settings, None).tolist(),
            },
        }
        (folder / "problem.json").write_text(json.dumps(problem))
        done = subprocess.run(
            [python, HERE / "identify_aixcalibuha.py", folder / "problem.json"],
            capture_output=True,
            text=True,
            timeout=2.0 * seconds + 120.0,
            check=False,
        )
        if done.returncode:
            raise SystemExit(f"AixCaliBuHA failed: {done.stderr.strip()[-2000:]}")
        *rows, end = [json.loads(line) for line in (folder / "log.jsonl").read_text().splitlines()]
    by_variable = {p.variable: p.name for p in point.space.parameters}
    trail = Trail(
        np.array([row["seconds"] for row in rows]),
        np.array([row["cost"] for row in rows]),
        {by_variable[variable]: value for variable, value in rows[-1]["parameters"].items()},
        {},
        end["seconds"],
        end["cpu"],
        end["evaluations"],
    )
    return trail, end["seconds"] < seconds, end["probe"]


def cost_of(recording: Path, values: dict[str, float]) -> float:
    """Equation 6 per sample at ``values``, by our own runner."""
    scenario = scenario_of(recording, linear=True)
    point = build_point(scenario, scenario.points[0])
    (case,) = point.cases
    with LocalRunner([case.experiment("at", TermsReducer(case.channels, point.error))], workers=1) as runner:
        (outcome,) = runner.run([Job("at", point.space.assignments(values, case.name))])
    return float(np.sum(outcome.reduced)) / point.samples


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", nargs="?", type=Path, default=RECORDING)
    parser.add_argument("--workers", type=int, default=2, help="of ours")
    parser.add_argument("--seconds", type=float, default=900.0, help="AixCaliBuHA is stopped after these")
    parser.add_argument("--environment", type=Path, default=CACHE / "aixcalibuha", help="where to make it")
    options = parser.parse_args()
    recording: Path = options.recording

    python = environment(options.environment)
    ours = [run_ours(recording, options.workers, linear=False)]
    linear = [run_ours(recording, options.workers, linear=True)]
    theirs, ended, probed = run_theirs(recording, python, options.seconds, ours[0].values)
    ours.append(run_ours(recording, options.workers, linear=False))
    linear.append(run_ours(recording, options.workers, linear=True))

    target = float(theirs.costs[-1])
    for name, trail in [("ours", ours[0]), ("ours, linear", linear[0]), ("aixcalibuha", theirs)]:
        print(
            f"# {name}: {trail.runs} runs in {trail.total:.1f} s ({trail.cpu:.1f} s of processor time),"
            f" lowest cost per sample {trail.costs[-1]:.5f}"
        )
    if not ended:
        print(f"# aixcalibuha was stopped after {options.seconds:g} s")
    again = cost_of(recording, theirs.values)
    print(
        f"# its best vector by our cost: {again:.5f}, by its own: {target:.5f}; ours by its own: {probed:.5f}"
    )
    print(f"# the cost to reach: {target:.5f}, where 1 is noise")
    took = theirs.time_to(target)
    for line, trails in (("vs_aixcalibuha", ours), ("vs_aixcalibuha_linear", linear)):
        times = [trail.time_to(target) for trail in trails]
        print(f"# aixcalibuha {took:.1f} s, ours " + " and ".join(f"{t:.1f} s" for t in times))
        print(
            f"{line} {took / np.mean(times):.1f}"
            + ("" if ended else " (its search was stopped before its end)")
        )
    least = ours[0].costs[-1]
    if theirs.costs[-1] > least:
        whole = theirs.total / np.mean([trail.total for trail in ours])
        print(f"# to the cost that ours ends with ({least:.5f}), which it has not found: >= {whole:.1f}")
    print(f"cpu_per_run {theirs.cpu / theirs.runs / np.mean([t.cpu / t.runs for t in ours]):.1f}")
    scenario = scenario_of(recording, linear=True)
    temperature = float(scenario.points[0].temperature_degC or 0.0)
    for name, law in scenario.laws.items():
        if law.published is None or law.published_form is None:
            continue
        true = float(published_law(law.published_form, law.published)(temperature))
        errors = [100.0 * abs(found.values[name] / true - 1.0) for found in (ours[0], theirs)]
        stated = 100.0 * ours[0].stderr[name] / abs(true)
        print(f"error_{name} ours {errors[0]:.2f} % (± {stated:.2f} %) aixcalibuha {errors[1]:.2f} %")


if __name__ == "__main__":
    main()
