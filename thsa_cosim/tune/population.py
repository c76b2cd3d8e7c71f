"""The population over the generations, told from the vectors that were tried and their costs.

The search reports its best only; which vector survived follows from the rule of differential evolution with
whole generations: a trial takes the place of its parent where it costs no more, and the best moves to the
front (SciPy's ``differential_evolution``, ``updating="deferred"``).
"""

from dataclasses import dataclass, field

import numpy as np

from thsa_cosim.signals import FloatArray


@dataclass
class PopulationPath:
    """Populations (S, n) by generation, in the parameters' units, with their costs (S,)."""

    populations: list[FloatArray] = field(default_factory=list)
    costs: list[FloatArray] = field(default_factory=list)

    def add(self, trials: FloatArray, costs: FloatArray) -> None:
        """Take the next generation's trials (S, n) with their costs (S,); NaN counts as infinite."""
        costs = np.where(np.isnan(costs), np.inf, costs)
        if not self.populations:
            population, kept = trials.copy(), costs.copy()
        else:
            better = costs <= self.costs[-1]
            population = np.where(better[:, None], trials, self.populations[-1])
            kept = np.where(better, costs, self.costs[-1])
        best = int(np.argmin(kept))
        population[[0, best]] = population[[best, 0]]
        kept[[0, best]] = kept[[best, 0]]
        self.populations.append(population)
        self.costs.append(kept)


@dataclass(frozen=True)
class Line:
    """``ratio``: median of numerator/denominator over the populations of the last generations.

    ``low`` and ``high``: its quartiles.
    """

    numerator: str
    denominator: str
    ratio: float
    low: float
    high: float
    generations: int
    published: float | None


def line_of(
    path: PopulationPath,
    numerator: tuple[str, int],
    denominator: tuple[str, int],
    last: int,
    published: float | None,
) -> Line | None:
    """The line of the last generations; names with their columns. None without a usable vector."""
    chosen = path.populations[-last:]
    costs = path.costs[-last:]
    if not chosen:
        return None
    vectors = np.concatenate(chosen)[np.isfinite(np.concatenate(costs))]
    below = vectors[:, denominator[1]]
    vectors = vectors[below != 0.0]
    if not len(vectors):
        return None
    ratios = vectors[:, numerator[1]] / vectors[:, denominator[1]]
    low, ratio, high = np.quantile(ratios, [0.25, 0.5, 0.75]).tolist()
    return Line(numerator[0], denominator[0], ratio, low, high, len(chosen), published)
