"""The strongest identification that a user would write with SciPy and fmpy; `studies.py` runs it beside ours.

    python benchmarks/script_least_squares.py TASK.pickle

Each FMU is unzipped, read and instantiated once and reset between runs; inputs, outputs and the communication loop use
prepared ctypes arrays (fmpy's own `simulate_fmu` takes about five times as long); SciPy's `least_squares` starts from
three vectors of a Latin hypercube per temperature, and the best of the three is kept. The task holds plain
arrays: reading recordings, units and noise is not timed. Prints cost, values, runs and CPU seconds as JSON.
"""

import ctypes
import json
import pickle
import sys
import tempfile
import time
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from scipy.optimize import least_squares
from scipy.stats import qmc


class Loop:
    """One FMU, opened once."""

    def __init__(self, path):
        self.description = fmpy.read_model_description(path)
        self.reference = {v.name: v.valueReference for v in self.description.modelVariables}
        self.slave = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=fmpy.extract(path, tempfile.mkdtemp()),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="script",
        )
        self.slave.instantiate()
        self.fresh = True

    def run(self, start, time, inputs, held, outputs, tolerance):
        """Outputs (n, m) at ``time`` (n,); inputs that are not held are given with their slopes."""
        slave = self.slave
        if not self.fresh:
            slave.reset()
        self.fresh = False
        slave.setReal([self.reference[name] for name in start], list(start.values()))
        slave.setupExperiment(tolerance=tolerance, startTime=time[0])
        slave.enterInitializationMode()
        names = list(inputs)
        count, wanted = len(names), len(outputs)
        given = (ctypes.c_uint32 * count)(*[self.reference[name] for name in names])
        asked = (ctypes.c_uint32 * wanted)(*[self.reference[name] for name in outputs])
        order = (ctypes.c_int * count)(*[1] * count)
        table = np.ascontiguousarray(np.stack([inputs[name] for name in names], axis=1))
        slopes = np.vstack([np.diff(table, axis=0) / np.diff(time)[:, None], np.zeros(count)])
        slopes[:, [name in held for name in names]] = 0.0
        sloped = bool(slopes.any())
        found = np.empty((time.size, wanted))
        double = ctypes.POINTER(ctypes.c_double)
        at = table.ctypes.data
        slave.fmi2SetReal(slave.component, given, count, ctypes.cast(at, double))
        slave.exitInitializationMode()
        row, out, slope = 8 * count, found.ctypes.data, slopes.ctypes.data
        steps = np.append(np.diff(time), 0.0).tolist()
        for k, (t, step) in enumerate(zip(time.tolist(), steps, strict=True)):
            slave.fmi2SetReal(slave.component, given, count, ctypes.cast(at + k * row, double))
            if sloped:
                slave.fmi2SetRealInputDerivatives(
                    slave.component, given, count, order, ctypes.cast(slope + k * row, double)
                )
            slave.fmi2GetReal(slave.component, asked, wanted, ctypes.cast(out + 8 * k * wanted, double))
            if step:
                slave.fmi2DoStep(slave.component, t, step, 1)
        return found


def identify(point, loops, starts=3, seed=1):
    """The best of some least-squares searches at one temperature: cost, values, runs."""
    lower, upper, log = np.array(point["lower"]), np.array(point["upper"]), np.array(point["log"])
    low, high = np.where(log, np.log(np.where(log, lower, 1.0)), lower), np.where(log, np.log(upper), upper)
    runs = 0

    def physical(u):
        raw = low + u * (high - low)
        return np.where(log, np.exp(np.where(log, raw, 0.0)), raw)

    def residual(u):
        nonlocal runs
        parts = []
        for case in point["cases"]:
            runs += 1
            values = physical(u) * point["factor"] + point["offset"]
            start = {**case["fixed"], **dict(zip(point["variables"], values.tolist(), strict=True))}
            outputs = list(case["channels"])
            if case["fmu"] not in loops:
                loops[case["fmu"]] = Loop(case["fmu"])
            found = loops[case["fmu"]].run(
                start, case["time"], case["inputs"], case["held"], outputs, case["tolerance"]
            )
            for j, name in enumerate(outputs):
                rows, measured, noise = case["channels"][name]
                parts.append((found[rows, j] - measured) / noise)
        return np.concatenate(parts)

    vectors = qmc.LatinHypercube(len(lower), rng=seed).random(starts)
    ends = [
        least_squares(residual, u, bounds=(0.0, 1.0), x_scale="jac", diff_step=1e-4, ftol=1e-8)
        for u in vectors
    ]
    best = min(ends, key=lambda end: end.cost)
    return {
        "label": point["label"],
        "cost": 2.0 * best.cost,
        "values": physical(best.x).tolist(),
        "runs": runs,
    }


def main():
    """Identify every point of the task."""
    task = pickle.loads(Path(sys.argv[1]).read_bytes())
    begin, loops = time.process_time(), {}
    points = [identify(point, loops) for point in task]
    seconds = time.process_time() - begin
    print(json.dumps({"cpu": seconds, "points": points}))


if __name__ == "__main__":
    main()
