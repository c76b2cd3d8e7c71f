"""Differential evolution (Storn and Price, 1997) over the unit cube, one batch per generation.

SciPy's solver does the evolving; here are the article's setting, a population of exactly S vectors, a
report per generation, and a stop that says why. A seed fixes every proposed vector, so a search that is
run again with the costs of a journal repeats itself to the bit: that is the checkpoint.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, get_args

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.search.strategies import Strategy

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

FloatArray = NDArray[np.float64]
Evaluate = Callable[[FloatArray], FloatArray]

STRATEGIES: tuple[str, ...] = get_args(Strategy)


@dataclass(frozen=True)
class EvolutionSettings:
    """How to evolve; the defaults are the article's S, G, F and CR.

    ``tolerance``: the search stops early once the costs of the population lie within this share of the
    best one (or once all vectors lie within ``spread_tolerance`` of the cube's edge in every direction).
    0 switches either test off.
    """

    population: int = 45
    generations: int = 30
    mutation: float = 0.16
    crossover: float = 0.5
    strategy: Strategy = "rand1bin"
    seed: int = 1
    tolerance: float = 1e-3
    spread_tolerance: float = 1e-5


@dataclass(frozen=True)
class Generation:
    """The state after a generation; index 0 is the initial population.

    ``spread``: standard deviation of the population per direction, (n,), in the unit cube. ``best``: the
    best vector, (n,). Costs that are not finite are left out of ``median_cost``.
    """

    index: int
    best_cost: float
    median_cost: float
    spread: FloatArray
    best: FloatArray
    evaluations: int


@dataclass(frozen=True)
class EvolutionResult:
    """The best vector ``best`` (n,) with its ``cost``, the last population (S, n) with its costs (S,)."""

    best: FloatArray
    cost: float
    population: FloatArray
    costs: FloatArray
    history: tuple[Generation, ...]
    evaluations: int
    converged: bool
    reason: str


def initial_population(dimension: int, settings: EvolutionSettings, start: FloatArray | None) -> FloatArray:
    """Latin hypercube of (S, n) in [0, 1]; ``start`` (n,), if any, takes the place of the first vector."""
    # McKay, Beckman and Conover (1979): one vector in each of S slices of every direction.
    rng = np.random.default_rng(settings.seed)
    slices = np.stack([rng.permutation(settings.population) for _ in range(dimension)], axis=1)
    population = (slices + rng.random(slices.shape)) / settings.population
    if start is not None:
        population[0] = np.clip(start, 0.0, 1.0)
    return population


def evolve(
    evaluate: Evaluate,
    dimension: int,
    settings: EvolutionSettings,
    *,
    start: FloatArray | None = None,
    on_generation: Callable[[Generation], None] | None = None,
) -> EvolutionResult:
    """Minimise ``evaluate`` over [0, 1]^n.

    ``evaluate`` takes a whole generation (S, n) and returns its costs (S,); NaN counts as +inf. It is
    called once for the initial population and once per generation, always from the calling thread.
    """
    from scipy.optimize import Bounds, differential_evolution  # slow to import, and local searches come first

    history: list[Generation] = []
    evaluations = 0
    reason = ""

    def costs_of(vectors: FloatArray) -> FloatArray:
        nonlocal evaluations
        costs = np.asarray(evaluate(vectors), dtype=np.float64)
        if costs.shape != (len(vectors),):
            raise RuntimeError(f"evaluate returned shape {costs.shape} for {len(vectors)} vectors.")
        evaluations += len(vectors)
        # SciPy keeps a NaN cost as a best point for ever; +inf it handles.
        return np.where(np.isnan(costs), np.inf, costs)

    def record(population: FloatArray, costs: FloatArray) -> None:
        finite = costs[np.isfinite(costs)]
        k = int(np.argmin(costs))
        generation = Generation(
            index=len(history),
            best_cost=float(costs[k]),
            median_cost=float(np.median(finite)) if finite.size else float("inf"),
            spread=np.std(population, axis=0),
            best=np.array(population[k]),
            evaluations=evaluations,
        )
        history.append(generation)
        if on_generation is not None:
            on_generation(generation)

    def workers(_: object, vectors: FloatArray) -> FloatArray:
        vectors = np.asarray(vectors, dtype=np.float64)
        costs = costs_of(vectors)
        if not history:
            record(vectors, costs)
        return costs

    def callback(intermediate_result: "OptimizeResult") -> None:
        nonlocal reason
        population = np.asarray(intermediate_result.population, dtype=np.float64)
        costs = np.asarray(intermediate_result.population_energies, dtype=np.float64)
        record(population, costs)
        reason = convergence_reason(population, costs, settings)
        if reason:
            raise StopIteration

    # While some costs are infinite, SciPy's own convergence test computes inf - inf.
    with np.errstate(invalid="ignore"):
        result = differential_evolution(
            _not_called,
            bounds=Bounds(np.zeros(dimension), np.ones(dimension)),
            strategy=settings.strategy,
            maxiter=settings.generations,
            init=initial_population(dimension, settings, start),
            mutation=settings.mutation,
            recombination=settings.crossover,
            rng=np.random.default_rng([settings.seed, 1]),
            tol=0.0,
            atol=0.0,
            polish=False,
            updating="deferred",
            workers=workers,  # type: ignore[arg-type]  # the stubs ask for an int that can be called
            callback=callback,
        )
    population = np.asarray(result.population, dtype=np.float64)
    costs = np.asarray(result.population_energies, dtype=np.float64)
    return EvolutionResult(
        best=np.asarray(result.x, dtype=np.float64),
        cost=float(result.fun),
        population=population,
        costs=costs,
        history=tuple(history),
        evaluations=evaluations,
        converged=bool(reason),
        reason=reason or f"all {settings.generations} generations were used",
    )


def _not_called(_: FloatArray) -> float:
    raise AssertionError("whole generations are evaluated")


def convergence_reason(population: FloatArray, costs: FloatArray, settings: EvolutionSettings) -> str:
    """Why a population (S, n) with costs (S,) has converged, or an empty string."""
    if not np.isfinite(costs).all():
        return ""
    best = float(np.min(costs))
    span = float(np.max(costs)) - best
    if settings.tolerance > 0.0 and span <= settings.tolerance * abs(best):
        return f"converged: all costs lie within {settings.tolerance:g} of the best"
    width = float(np.max(np.ptp(population, axis=0)))
    if settings.spread_tolerance > 0.0 and width <= settings.spread_tolerance:
        return f"converged: the population is narrower than {settings.spread_tolerance:g} of the bounds"
    return ""
