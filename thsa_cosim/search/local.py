"""Local first: least squares from several spread starts, which agree on a minimum or do not.

Where all local searches from different starts end in the same minimum, a global search has nothing to add, and their
agreement is better evidence of a single minimum than one evolution is. Where they do not agree, more are
started; the caller then falls back on a global search.

The vectors are a Latin hypercube, dealt to the starts at random; each start is the best of its hand, so that searches
neither begin where nothing can be simulated nor all at the same place.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from thsa_cosim.costs.identification import ERRORS
from thsa_cosim.search.differences import Asking, Box, FloatArray, Residual, Residuals
from thsa_cosim.search.least_squares import LeastSquaresSettings, Minimum, least_squares, smooth_cost

#: Two searches agree when their ends are less than so many standard errors apart, and so is the rise of the cost.
AGREE = 1.0
#: Solvers leave a cost uncertain by this share.
COST_NOISE = 1e-6


@dataclass(frozen=True)
class LocalSettings:
    """``starts`` searches first; if they do not all agree, up to ``most``, of which ``needed`` have to agree.

    ``hand``: vectors of which each start is the best.
    """

    starts: int = 3
    most: int = 8
    needed: int = 4
    hand: int = 4
    seed: int = 1
    least_squares: LeastSquaresSettings = field(default_factory=LeastSquaresSettings)


@dataclass(frozen=True, eq=False)
class LocalSearch:
    """One search: ``start`` (n,), the end ``best`` (n,), the costs after each step (the start's first).

    ``agrees``: it ended in the best minimum that any of them found.
    """

    start: FloatArray
    best: FloatArray
    history: tuple[float, ...]
    evaluations: int
    converged: bool
    reason: str
    agrees: bool = False

    @property
    def cost(self) -> float:
        """Of the end."""
        return self.history[-1]


@dataclass(frozen=True, eq=False)
class LocalResult:
    """The best minimum, and every search that was started; ``settled``: enough of them agree."""

    minimum: Minimum
    minima: tuple[Minimum, ...]
    searches: tuple[LocalSearch, ...]
    settled: bool
    evaluations: int

    @property
    def agreed(self) -> int:
        """Searches that ended in the best minimum."""
        return sum(search.agrees for search in self.searches)

    def with_minimum(self, other: Minimum, error: str) -> "LocalResult":
        """The same after a global search that ended in ``other``: the better of both is what has to be agreed with."""
        minima = [*self.minima, other]
        best = min(minima, key=lambda minimum: minimum.cost)
        searches = tuple(
            replace(search, agrees=same_minimum(minimum, best, error))
            for search, minimum in zip(self.searches, self.minima, strict=True)
        )
        return replace(self, minimum=best, searches=searches)


def agreement(searches: Sequence[LocalSearch]) -> str:
    """How many of the searches ended in the best minimum, as a sentence without its full stop."""
    agreed = sum(search.agrees for search in searches)
    return f"{agreed} of {len(searches)} local searches from different starts agree"


def search_locally(
    evaluate: Residuals,
    dimension: int,
    settings: LocalSettings,
    start: FloatArray | None = None,
    on_searches: Callable[[int], None] | None = None,
) -> LocalResult | None:
    """Minimise from several starts in [0, 1]^n; None if no start could be simulated.

    ``start`` (n,), if any, is the first start. All searches share each batch of vectors. ``on_searches`` is told how
    many searches are under way whenever some are started.
    """
    rng = np.random.default_rng([settings.seed, 2])
    starts: list[FloatArray] = []
    minima: list[Minimum] = []
    searches: tuple[LocalSearch, ...] = ()
    evaluations = 0
    for count in (settings.starts, settings.most - settings.starts):
        if on_searches is not None:
            on_searches(count)
        given = start if not starts else None
        vectors, residuals = _starts(evaluate, rng, dimension, count, settings, given)
        evaluations += count * settings.hand
        tasks = [
            least_squares(v, Box.unit(dimension), settings.least_squares, residual=r)
            for v, r in zip(vectors, residuals, strict=True)
        ]
        for vector, minimum in zip(vectors, together(tasks, evaluate), strict=True):
            assert minimum is not None, "the residuals of every start are known"
            starts.append(vector)
            minima.append(minimum)
            evaluations += minimum.evaluations
        if not minima:
            return None  # nothing can be simulated but, perhaps, a small part: not a task for local searches
        searches = _compare(starts, minima, settings.least_squares.error)
        agreed = sum(search.agrees for search in searches)
        if agreed == len(searches) >= settings.starts:
            break
    best = min(minima, key=lambda minimum: minimum.cost)
    settled = agreed >= settings.needed or agreed == len(searches) >= settings.starts
    return LocalResult(best, tuple(minima), searches, settled, evaluations)


def together(tasks: Sequence[Asking[Minimum | None]], evaluate: Residuals) -> list[Minimum | None]:
    """Run several searches at once: their vectors are evaluated as one batch."""
    results: list[Minimum | None] = [None] * len(tasks)
    asked: dict[int, FloatArray] = {}

    def advance(k: int, replies: Sequence[Residual] | None) -> None:
        try:
            asked[k] = next(tasks[k]) if replies is None else tasks[k].send(replies)
        except StopIteration as stop:
            asked.pop(k, None)
            results[k] = stop.value

    for k in range(len(tasks)):
        advance(k, None)
    while asked:
        order = list(asked)
        replies = iter(evaluate(np.concatenate([asked[k] for k in order])))
        for k in order:
            advance(k, [next(replies) for _ in asked[k]])
    return results


def _starts(
    evaluate: Residuals,
    rng: np.random.Generator,
    dimension: int,
    count: int,
    settings: LocalSettings,
    given: FloatArray | None,
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Start vectors with their residuals: the best of each hand, and ``given`` if it can be simulated."""
    size = count * settings.hand
    # McKay, Beckman and Conover (1979): one vector in each slice of every direction.
    slices = np.stack([rng.permutation(size) for _ in range(dimension)], axis=1)
    hands = (slices + rng.random(slices.shape)) / size
    if given is not None:
        hands[: settings.hand] = np.clip(given, 0.0, 1.0)
    # A start that is given needs no hand to choose from.
    left_out = 0 if given is None else settings.hand - 1
    residuals: list[Residual] = [*[None] * left_out, *evaluate(hands[left_out:])]
    vectors, known = [], []
    box = Box.unit(dimension)
    for first in range(0, size, settings.hand):
        usable = [
            (cost, k)
            for k, r in enumerate(residuals[first : first + settings.hand], start=first)
            if r is not None and np.isfinite(cost := smooth_cost(r, settings.least_squares.error))
        ]
        if usable:
            k = min(usable)[1]
            residual = residuals[k]
            assert residual is not None
            vectors.append(box.clip(hands[k]))
            known.append(residual)
    return vectors, known


def _compare(starts: Sequence[FloatArray], minima: Sequence[Minimum], error: str) -> tuple[LocalSearch, ...]:
    """The searches, and which of them ended in the best minimum."""
    best = min(minima, key=lambda minimum: minimum.cost)
    return tuple(
        LocalSearch(start, m.x, m.history, m.evaluations, m.converged, m.reason, same_minimum(m, best, error))
        for start, m in zip(starts, minima, strict=True)
    )


def same_minimum(other: Minimum, best: Minimum, error: str) -> bool:
    """Whether a search ended within a standard error of the best end, at no higher cost than that explains."""
    function = ERRORS[error]
    slope = function.slope(best.residual)
    unit = float(np.mean(function.psi(best.residual) ** 2)) / max(float(np.mean(slope)), 1e-12)
    change = best.jacobian @ (other.x - best.x)
    distance = float(np.sum(slope * change**2))
    slack = COST_NOISE * abs(best.cost)
    return other.cost - best.cost <= AGREE**2 * unit + slack and distance <= AGREE**2 * unit + slack
