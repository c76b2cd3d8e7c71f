"""Runs per second of the local runner against what users write today, and against the limit.

    python benchmarks/throughput.py [FMU] [--workers 2] [--rounds 5] [--jobs 120]

One 3 s recording at 1 kHz (a ramp to 9 mm/s under 55 kN at -30 degC), new gains in every run. Prints

    vs_fmpy_pool   ours / (fmpy.simulate_fmu with unpacked folder and description, in multiprocessing.Pool)
    of_limit       ours / (a compiled loop that only does the same FMU calls, in one process, times workers)
    two_workers    ours with `workers` / ours with one

Rounds of all contestants alternate, and each one's best round counts: other load on the machine only ever
makes a round slower.
"""

import argparse
import multiprocessing
import sys
import tempfile
import time
from pathlib import Path

# The benchmark next door is called coverage.py, and numba imports a package of that name.
sys.path[:] = [entry for entry in sys.path if Path(entry).resolve() != Path(__file__).resolve().parent]

import fmpy
import numpy as np

from thsa_cosim.batch import Experiment, Job, LocalRunner
from thsa_cosim.fmu import Plant
from thsa_cosim.fmu.compiled import advance
from thsa_cosim.fmu.plan import Plan
from thsa_cosim.fmu.stepping import Tables
from thsa_cosim.signals import Signals

OUTPUTS = ("v", "i_q")


def recording(duration: float = 3.0, step: float = 1e-3) -> Signals:
    t = np.arange(round(duration / step) + 1) * step
    return Signals(
        t,
        {
            "v_cmd": np.clip(0.03 * (t - 0.1), 0.0, 0.009),
            "F_load": np.full_like(t, 55e3),
            "T_amb": np.full_like(t, -30.0),
        },
        {"v_cmd": "m/s", "F_load": "N", "T_amb": "degC"},
    )


def gains(count: int) -> list[dict[str, float]]:
    random = np.random.default_rng(1)
    return [
        {"velocityController.K_p": float(p), "velocityController.K_i": float(i)}
        for p, i in random.uniform((0.1, 0.4), (0.4, 3.0), (count, 2))
    ]


def mean_square(signals: Signals) -> np.ndarray:
    return np.array([np.mean(signals["v"] ** 2), np.mean(signals["i_q"] ** 2)])


# -- what users write today --------------------------------------------------------------------------------
_state = {}


def pool_start(fmu: str, folder: str) -> None:
    import fmpy

    _state["folder"] = folder
    _state["description"] = fmpy.read_model_description(fmu)
    drive = recording()
    names = ["time", *drive.names]
    columns = [drive.time, *(drive[n] for n in drive.names)]
    _state["input"] = np.rec.fromarrays(columns, names=names)


def pool_run(values: dict[str, float]) -> float:
    import fmpy

    result = fmpy.simulate_fmu(
        _state["folder"],
        model_description=_state["description"],
        start_values=values,
        input=_state["input"],
        output=list(OUTPUTS),
        stop_time=3.0,
        output_interval=1e-3,
    )
    return float(np.mean(result["v"] ** 2))


# -- the limit ---------------------------------------------------------------------------------------------
def bare_loop(fmu: str, pipe: "multiprocessing.connection.Connection") -> None:
    """Answer each list of start values by the seconds that the bare FMU calls took."""
    drive = recording()
    with Plant.open(fmu) as plant:
        first = gains(1)[0]
        plant.run(first, drive, OUTPUTS, drive.time)
        instance = plant._instance
        plan = Plan(instance, drive, OUTPUTS, drive.time)
        settable = plant._settable(instance, tuple(first))
        tables = Tables(instance, plan)
        times, stop = plan.grid.times, plan.grid.stop
        progress = np.zeros(4)
        while (batch := pipe.recv()) is not None:
            vectors = [np.array(list(values.values())) for values in batch]
            begin = time.perf_counter()
            for vector in vectors:
                instance.instantiate()
                instance.set_values(settable, vector)
                instance.initialize_begin(times[0], stop, None)
                instance.set_values(plan.input_channels, plan.first)
                instance.initialize_end()
                _, what, _ = tables.advance(advance, instance, plan, progress)
                assert what == 0
                instance.terminate()
                instance.free()
            pipe.send(time.perf_counter() - begin)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmu", nargs="?", default=str(Path(__file__).parents[1] / "fmus" / "THSA.fmu"))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=120)
    arguments = parser.parse_args()
    fmu, workers, count = arguments.fmu, arguments.workers, arguments.jobs
    values = gains(count)
    few = values[: max(2 * workers, count // 8)]
    drive = recording()
    experiment = Experiment("ramp", Path(fmu), drive, OUTPUTS, drive.time, reduce=mean_square)
    jobs = [Job("ramp", v) for v in values]
    context = multiprocessing.get_context("spawn")
    rates: dict[str, list[float]] = {"ours": [], "one": [], "pool": [], "bare": []}

    def rate(runner: LocalRunner, jobs: list[Job]) -> float:
        begin = time.perf_counter()
        outcomes = runner.run(jobs)
        elapsed = time.perf_counter() - begin
        assert all(outcome.ok for outcome in outcomes), next(o.reason for o in outcomes if not o.ok)
        return len(jobs) / elapsed

    unpacked = tempfile.TemporaryDirectory()
    fmpy.extract(fmu, unpacked.name)
    here, there = context.Pipe()
    bare = context.Process(target=bare_loop, args=(fmu, there), daemon=True)
    bare.start()
    with (
        unpacked,
        LocalRunner([experiment], workers=workers) as ours,
        LocalRunner([experiment], workers=1) as one,
        context.Pool(workers, pool_start, (fmu, unpacked.name)) as pool,
    ):
        # Everyone starts, loads and runs once before the clock does.
        ours.run(jobs[: 4 * workers])
        one.run(jobs[:4])
        pool.map(pool_run, few, chunksize=1)
        here.send(values[:4])
        here.recv()
        for _ in range(arguments.rounds):
            rates["ours"].append(rate(ours, jobs))
            here.send(values[: count // 2])
            rates["bare"].append((count // 2) / here.recv())
            rates["one"].append(rate(one, jobs[: count // 2]))
            begin = time.perf_counter()
            pool.map(pool_run, few, chunksize=1)
            rates["pool"].append(len(few) / (time.perf_counter() - begin))
    here.send(None)
    bare.join(5)
    best = {name: max(found) for name, found in rates.items()}
    for name, what in (
        ("ours", f"ours, {workers} workers"),
        ("one", "ours, 1 worker"),
        ("bare", "bare loop, 1 process"),
        ("pool", f"fmpy in a pool of {workers}"),
    ):
        low, high = min(rates[name]), max(rates[name])
        print(f"# {what}: {best[name]:.1f} runs/s (rounds from {low:.1f} to {high:.1f})")
    print(f"vs_fmpy_pool {best['ours'] / best['pool']:.1f}")
    print(f"of_limit {best['ours'] / (workers * best['bare']):.2f}")
    print(f"two_workers {best['ours'] / best['one']:.2f}")


if __name__ == "__main__":
    main()
