"""The AixCaliBuHA side of identify.py: runs in an environment of its own and imports nothing of ours.

    python identify_aixcalibuha.py PROBLEM.json

Writes one line of JSON per improvement (seconds, evaluations, cost per sample, parameters) to the file that the
problem names, and a last one when the search is over: what it took, and the cost at the problem's probe.
"""

import json
import logging
import resource
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
from aixcalibuha import CalibrationClass, Goals, TunerParas
from aixcalibuha.calibration import Calibrator
from ebcpy import FMU_API


class Recorder(Calibrator):
    """Notes the time of every improvement."""

    def _check_for_termination(self) -> None:
        best = self._current_best_iterate
        cost = best["Objective"] * self.per_sample
        if cost < self.lowest:
            self.lowest = cost
            row = {**self.spent(), "cost": cost, "parameters": dict(best["Parameters"])}
            self.log_file.write(json.dumps(row) + "\n")
            self.log_file.flush()
        super()._check_for_termination()

    def spent(self) -> dict[str, float]:
        return {"seconds": time.perf_counter() - self.begin, "evaluations": self._counter}


def main() -> None:
    problem = json.loads(Path(sys.argv[1]).read_text())
    logging.disable(logging.INFO)
    table = pd.read_parquet(problem["data"])
    time_axis = pd.Index(table["time"].to_numpy(), name="time")
    channels = problem["noise"]
    weights = {name: 1.0 / noise**2 for name, noise in channels.items()}
    names = [p["variable"] for p in problem["parameters"]]
    begin = time.perf_counter()
    api = FMU_API(problem["fmu"], working_directory=problem["folder"], log_fmu=False)
    goals = Goals(
        meas_target_data=table[list(channels)].set_index(time_axis),
        variable_names={name: {"meas": name, "sim": name} for name in channels},
        statistical_measure="MSE",
        weightings=list(weights.values()),
    )
    tuned = TunerParas(
        names=names,
        initial_values=[0.5 * (p["lower"] + p["upper"]) for p in problem["parameters"]],
        bounds=[(p["lower"], p["upper"]) for p in problem["parameters"]],
    )
    case = CalibrationClass(
        name="motor",
        start_time=float(time_axis[0]),
        stop_time=float(time_axis[-1]),
        goals=goals,
        tuner_paras=tuned,
        inputs=table[problem["inputs"]].set_index(time_axis),
        relevant_intervals=[tuple(interval) for interval in problem["intervals"]],
    )
    calibrator = Recorder(
        problem["folder"],
        api,
        case,
        verbose_logging=False,
        fixed_parameters=problem["fixed"],
        max_time=problem["seconds"],
    )
    # Their objective is Σ w MSE / Σ w; equation 6 per sample is the mean over channels of MSE / noise².
    calibrator.per_sample = sum(weights.values()) / len(weights)
    calibrator.lowest, calibrator.begin = np.inf, begin
    search = problem["search"]
    with Path(problem["log"]).open("a") as calibrator.log_file:
        calibrator.calibrate(
            "scipy_differential_evolution",
            method=search["strategy"],
            maxiter=search["generations"],
            mutation=search["mutation"],
            recombination=search["crossover"],
            init=np.array(search["population"]),
            seed=search["seed"],
        )
        usage = resource.getrusage(resource.RUSAGE_SELF)
        searched = calibrator.spent()
        # The probe is no part of the search: neither a time limit nor an improvement.
        calibrator.max_time, calibrator.lowest = np.inf, -np.inf
        scaled = tuned.scale(pd.Series(problem["probe"], index=names))
        probe = calibrator.obj(scaled.to_numpy()) * calibrator.per_sample
        row = {**searched, "cpu": usage.ru_utime + usage.ru_stime, "probe": probe}
        calibrator.log_file.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
