"""The strongest tuning that a user would write with SciPy and fmpy; `studies.py` runs it beside ours.

    python benchmarks/script_tuning.py SCENARIO COST [--seed 1]

SciPy's differential evolution with its polish, in one process, over the lean loop of `script_least_squares.py`: the FMU
is opened once and reset between runs, and asked at every sample. What becomes of a response (metrics, margins,
requirements, their sum) is computed by our own functions, so that both minimise the same number; a user would have to
write them. It ends where it is within 0.1 % of COST, or where SciPy says that it has converged. Prints cost, runs and
CPU seconds as JSON.
"""

import argparse
import contextlib
import json
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:] = [entry for entry in sys.path if Path(entry or ".").resolve() != HERE]

from scipy.optimize import differential_evolution

from thsa_cosim.scenario import load
from thsa_cosim.signals import Signals
from thsa_cosim.tune.combine import combine
from thsa_cosim.tune.problem import build_groups
from thsa_cosim.tune.response import Terms

sys.path.append(str(HERE))
from script_least_squares import Loop

NEAR = 1.001


class Reached(Exception):
    """The cost that was asked for."""


class Problem:
    """The cost of gains (n,) over all conditions of a tuning; keeps the best, and says when it is good enough."""

    def __init__(self, scenario_path, target):
        self.scenario = load(Path(scenario_path))
        self.group = build_groups(self.scenario)[0]
        self.names = Terms.of(self.scenario).names
        self.loop = Loop(str(self.scenario.fmu.path))
        self.target, self.best, self.runs = target, np.inf, 0

    def __call__(self, unit):
        values = self.scenario.parameters.assignments(self.scenario.parameters.decode(np.asarray(unit)))
        terms = np.stack([self.terms(case.experiment, values) for case in self.group.cases])
        found = combine(self.scenario, self.names, terms, self.group.weights, self.group.requirements)
        self.best = min(self.best, found.cost)
        if self.best <= NEAR * self.target:
            raise Reached
        return found.cost

    def terms(self, experiment, values):
        self.runs += 1
        inputs = {n: experiment.inputs.resample(experiment.time)[n] for n in experiment.inputs.names}
        table = self.loop.run(
            {**experiment.fixed, **values},
            experiment.time,
            inputs,
            experiment.inputs.held,
            experiment.outputs,
            experiment.tolerance,
        )
        columns = dict(zip(experiment.outputs, np.ascontiguousarray(table.T), strict=True))
        return experiment.reduce(Signals(experiment.time, columns))


def main():
    """Tune until the cost is reached."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario")
    parser.add_argument("cost", type=float)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    problem = Problem(options.scenario, options.cost)
    count = len(problem.scenario.parameters)
    begin, says = time.process_time(), "reached"
    with contextlib.suppress(Reached):
        says = differential_evolution(problem, [(0.0, 1.0)] * count, rng=options.seed, polish=True).message
    print(
        json.dumps(
            {
                "cpu": time.process_time() - begin,
                "cost": problem.best,
                "runs": problem.runs,
                "says": str(says),
            }
        )
    )


if __name__ == "__main__":
    main()
