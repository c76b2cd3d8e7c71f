"""Which DE strategy? Excess cost after some generations, and whether a polish from there finds the optimum.

    python benchmarks/strategies.py [SCENARIO] [--points -30 25] [--seeds 1 2 3] [--seconds 3.6] [--workers 2]

The article gives S = 45, G = 30, F = 0.16 and CR = 0.5 but no strategy. Every strategy here starts from the same
populations. ``excess`` is (J - J*)/N in units of the noise's variance, J* the best cost that any run found.
"""

import argparse
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np

from thsa_cosim.batch import Job, LocalRunner
from thsa_cosim.costs import ResidualReducer
from thsa_cosim.identify.problem import build_point
from thsa_cosim.scenario import load
from thsa_cosim.search import EvolutionSettings, PolishSettings, evolve, polish

SETTINGS = {
    "rand1bin": {},
    "best1bin": {"strategy": "best1bin"},
    "randtobest1bin": {"strategy": "randtobest1bin"},
    "currenttobest1bin": {"strategy": "currenttobest1bin"},
    "best2bin": {"strategy": "best2bin"},
    "rand1exp": {"strategy": "rand1exp"},
    "rand1bin F=.5 CR=.9": {"mutation": 0.5, "crossover": 0.9},
    "best1bin F=.5 CR=.9": {"strategy": "best1bin", "mutation": 0.5, "crossover": 0.9},
}
LOOK_AT = (5, 10, 15, 20, 30)
#: (J - J*) below which a polish has found the optimum: a hundredth of what one standard error costs.
FOUND = 0.01


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenario", nargs="?", type=Path, default=Path("scenarios/motor.toml"))
    parser.add_argument("--points", nargs="+", type=float, default=[-30.0, 25.0])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3])
    parser.add_argument("--seconds", type=float, default=3.6, help="of each recording, to save time")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()

    scenario = load(options.scenario)
    window = scenario.cost.window.model_copy(update={"stop": options.seconds})
    scenario = replace(scenario, cost=scenario.cost.model_copy(update={"window": window}))
    points = [build_point(scenario, p) for p in scenario.points if p.temperature_degC in options.points]
    experiments = []
    for point in points:
        for case in point.cases:
            short = replace(case, time=case.time[case.time <= case.time[0] + options.seconds])
            experiments.append(short.experiment(case.name, ResidualReducer(case.channels)))

    with LocalRunner(experiments, workers=options.workers) as runner:
        runs = []
        for point in points:

            def residuals(vectors, point=point):
                jobs = [
                    Job(case.name, point.space.assignments(point.space.decode(u), case.name))
                    for u in vectors
                    for case in point.cases
                ]
                reduced = iter([outcome.reduced for outcome in runner.run(jobs)])
                stacked = [[next(reduced) for _ in point.cases] for _ in vectors]
                return [None if any(r is None for r in row) else np.concatenate(row) for row in stacked]

            def costs(vectors, residuals=residuals):
                return np.array([np.inf if r is None else r @ r for r in residuals(vectors)])

            for seed in options.seeds:
                for name, changes in SETTINGS.items():
                    settings = EvolutionSettings(seed=seed, tolerance=0.0, spread_tolerance=0.0, **changes)
                    result = evolve(costs, point.space.dimension, settings)
                    runs.append((point, seed, name, result.history, residuals))
                    print(
                        f"{point.label:9s} seed {seed} {name:22s} J/N {result.cost / point.samples:.5f}",
                        flush=True,
                    )

        polished = {}
        for point, seed, name, history, residuals in runs:
            for k in LOOK_AT:
                found = polish(residuals, history[k].best, PolishSettings())
                cost = np.inf if found.residual is None else float(found.residual @ found.residual)
                polished[point.label, seed, name, k] = cost

    optimum = {
        point.label: min(c for key, c in polished.items() if key[0] == point.label) for point in points
    }
    excess, hits = defaultdict(list), defaultdict(list)
    for point, seed, name, history, _ in runs:
        for k in LOOK_AT:
            excess[name, k].append((history[k].best_cost - optimum[point.label]) / point.samples)
            hits[name, k].append(polished[point.label, seed, name, k] - optimum[point.label] < FOUND)
    count = len(points) * len(options.seeds)
    print(f"\nmedian excess after generation k | polish from there finds the optimum (of {count})")
    print(
        f"{'':22s} " + " ".join(f"{k:>9d}" for k in LOOK_AT) + "  | " + " ".join(f"{k:>3d}" for k in LOOK_AT)
    )
    for name in SETTINGS:
        left = " ".join(f"{np.median(excess[name, k]):9.2e}" for k in LOOK_AT)
        right = " ".join(f"{sum(hits[name, k]):3d}" for k in LOOK_AT)
        print(f"{name:22s} {left}  | {right}")


if __name__ == "__main__":
    main()
