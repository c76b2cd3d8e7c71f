"""The population of a search over its generations, told from the journal alone: it works while the search runs."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.batch import JournalTable
from thsa_cosim.tune.population import PopulationPath

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Evolution:
    """A stage's populations (S, n) with their costs (S,), by generation; the last may be incomplete."""

    label: str
    populations: tuple[FloatArray, ...]
    costs: tuple[FloatArray, ...]

    @property
    def quantiles(self) -> FloatArray:
        """(5, generations): least, lower quartile, median, upper quartile and largest cost of finite ones."""
        columns = []
        for costs in self.costs:
            finite = costs[np.isfinite(costs)]
            columns.append(
                np.quantile(finite, [0.0, 0.25, 0.5, 0.75, 1.0]) if finite.size else np.full(5, np.nan)
            )
        return np.array(columns, dtype=np.float64).reshape(-1, 5).T


def evolutions(
    journal: JournalTable,
    population: int | None,
    generations: int | None,
    used: Mapping[str, int] | None = None,
    infeasible: float = np.inf,
) -> list[Evolution]:
    """One evolution per stage of the journal.

    Rows are numbered in the order in which the search asks, ``population`` to a generation, so the slot of a
    vector follows from its number. ``used``: generations per stage that a finished search took (what it
    evaluated later, for a polish or a map of the cost, is no generation). Costs from ``infeasible`` up are
    given as infinite.
    """
    size = population or 0
    if size < 1:
        return []
    stages: dict[str, dict[int, tuple[tuple[float, ...], float]]] = {}
    for row in journal.rows:
        stages.setdefault(row.stage, {})[row.index - 1] = (row.values, row.cost)
    found = []
    for label, rows in stages.items():
        last = (used or {}).get(label, generations if generations is not None else 10**9)
        path = PopulationPath()
        for generation in range(last + 1):
            slots = [rows.get(generation * size + k) for k in range(size)]
            if not any(slots):
                break
            # A vector that was known already is in no second row; its slot then keeps its parent.
            empty = (np.nan,) * len(journal.names)
            trials = np.array([empty if slot is None else slot[0] for slot in slots])
            costs = np.array([np.inf if slot is None else slot[1] for slot in slots])
            path.add(trials, costs)
        if path.costs:
            shown = tuple(np.where(costs < infeasible, costs, np.inf) for costs in path.costs)
            found.append(Evolution(label, tuple(path.populations), shown))
    return found
