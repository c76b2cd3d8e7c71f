"""A model identified on the fit recordings and scored on the held-out ones: declared and extended alike."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np

from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, cost_of, refine
from thsa_cosim.diagnosis.fitting.inputs import draws_of, errors_of_inputs
from thsa_cosim.diagnosis.fitting.noise import without_noise
from thsa_cosim.diagnosis.fitting.trials import Trial, with_fmu
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.errors import StudyError
from thsa_cosim.scenario import OpenRunner, SimulationTable
from thsa_cosim.signals import FloatArray, Signals

#: Where a start cannot be simulated, so many vectors beside it are tried, within this share of the ordinary changes.
TRIES, NEAR = 4, 1e-3
#: Iterations from a start, and from one where the search has ended: what its own did not reach, these do not.
ITERATIONS, SEARCHED = 12, 4


@dataclass(frozen=True, eq=False)
class Identified:
    """A model identified on the fit recordings: its FMU, the fit, the held-out residuals (N,), and all its signals.

    ``apart`` (n,): how far the ends of several starts lie from the best one (`between_starts`). ``of_inputs`` (n,):
    what the noise of smoothed inputs adds to the standard errors.
    """

    fmu: Path
    fit: Fit
    validate: FloatArray
    trials: tuple[Trial, ...]
    signals: dict[str, Signals | None]
    evaluations: int
    failures: dict[str, int]
    apart: FloatArray
    of_inputs: FloatArray


def between_starts(best: Fit, ends: Sequence[tuple[FloatArray, float]]) -> FloatArray:
    """(n,) how far ``ends`` (vector (n,), cost) lie from the best fit, each as likely as its cost makes it.

    The root of the mean square over the best one and the ends; the costs count as what is left allows.
    """
    weights = np.array([np.exp(-0.5 * max(0.0, cost - best.cost) / best.inflation) for _, cost in ends])
    squares = np.array([(vector - best.vector) ** 2 for vector, _ in ends]).reshape(
        len(ends), best.vector.size
    )
    return np.asarray(np.sqrt(weights @ squares / (1.0 + weights.sum())))


def _runs(bench: Bench, unknowns: Unknowns, start: FloatArray) -> tuple[FloatArray, FloatArray | None]:
    """``start`` (n,) and its residuals (N,), or those of a vector close by where a solver fails at that very point."""
    (residual,) = bench.residuals(unknowns, start[None, :], "fit")
    if residual is not None:
        return start, residual
    shifts = NEAR * unknowns.scale * np.random.default_rng(0).uniform(-1.0, 1.0, (TRIES, start.size))
    vectors = np.array([unknowns.clip(start + shift) for shift in shifts])
    for vector, found in zip(vectors, bench.residuals(unknowns, vectors, "fit"), strict=True):
        if found is not None:
            return vector, found
    return start, None


def identify_model(
    fmu: Path,
    trials: tuple[Trial, ...],
    unknowns: Unknowns,
    starts: Sequence[FloatArray],
    simulation: SimulationTable,
    open_runner: OpenRunner,
    near: Fit | None = None,
) -> Identified:
    """Identify ``unknowns`` of an FMU on the fit recordings from every one of ``starts``; the best fit counts.

    ``near``: a fit of the same unknowns in an equal model, without weights, whose Jacobian leads the way; the last
    start is where a search has ended.
    StudyError if the FMU cannot be simulated at any start.
    """
    own = with_fmu(trials, fmu)
    draws = draws_of(own)
    with open_runner(simulation, [t.experiment for t in (*own, *chain(*draws))]) as runner:
        bench = Bench(runner, own)
        begun = [_runs(bench, unknowns, start) for start in starts]
        jacobian = None if near is None else near.jacobian_of(unknowns)
        steps = None if near is None else near.steps_of(unknowns)
        fits: list[Fit] = []
        ends: list[tuple[FloatArray, float]] = []
        costs = [np.inf if r is None else cost_of(unknowns, v, r) for v, r in begun]
        for number, (vector, residual) in enumerate(begun):
            known = min((f.cost for f in fits), default=np.inf)
            if residual is None:
                continue
            cost = costs[number]
            if fits and known <= cost + 1.0:
                ends.append((vector, cost))
                continue  # the fit so far is better than this start
            rest = min([known, *costs[number + 1 :]])
            fit = refine(
                bench,
                unknowns,
                vector,
                residual=residual,
                jacobian=jacobian,
                steps=steps,
                near=jacobian is not None,
                iterations=SEARCHED if near is not None and number == len(begun) - 1 else ITERATIONS,
                to_beat=rest,
            )
            fits += [] if fit is None else [fit]
        best = min(fits, key=lambda f: f.cost, default=None)
        ends += [(f.vector, f.cost) for f in fits if f is not best]
        best = None if best is None else without_noise(bench, best)
        validate = None if best is None else bench.residuals(unknowns, best.vector[None, :], "validate")[0]
        if best is None or validate is None:
            reason = next(iter(bench.failures), "no run succeeded")
            raise StudyError(f"{fmu.name} cannot be identified: {reason}")
        redrawn = [
            Bench(runner, trials).residuals(unknowns, best.vector[None, :], "fit")[0] for trials in draws
        ]
        return Identified(
            fmu,
            best,
            validate,
            own,
            bench.signals(unknowns, best.vector),
            bench.evaluations,
            bench.failures,
            between_starts(best, ends),
            errors_of_inputs(best, [residual for residual in redrawn if residual is not None]),
        )
