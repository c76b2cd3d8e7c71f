"""Which of many vectors are not beaten in two terms at once."""

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.batch import Journal
from thsa_cosim.scenario.tune_schema import ParetoTable
from thsa_cosim.signals import FloatArray
from thsa_cosim.tune.combine import INFEASIBLE
from thsa_cosim.tune.problem import ALL
from thsa_cosim.tune.results import Pareto


def front_of(spec: ParetoTable, journal: Journal) -> Pareto:
    """The front of the feasible sets of gains that the search over all conditions has tried."""
    i, j = journal.terms.index(spec.x), journal.terms.index(spec.y)
    # Rows come in as their simulations end; by their numbers they are in the order of the search.
    asked = sorted((row for row in journal.rows if row.stage == ALL), key=lambda row: row.index)
    rows = [row for row in asked if row.cost < INFEASIBLE]
    x, y = np.array([r.terms[i] for r in rows]), np.array([r.terms[j] for r in rows])
    chosen = front(x, y)
    values = np.array([rows[k].values for k in chosen]).reshape(len(chosen), len(journal.names))
    return Pareto(spec.x, spec.y, x[chosen], y[chosen], values, x, y)


def front(x: FloatArray, y: FloatArray) -> NDArray[np.intp]:
    """Indices of the non-dominated points of ``x``, ``y`` (m,), both to be small, in rising order of ``x``.

    Points with a number that is not finite are left out; of equal points the first is kept.
    """
    usable = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    order = usable[np.lexsort((y[usable], x[usable]))]
    kept, lowest = [], np.inf
    for k in order.tolist():
        if y[k] < lowest:
            kept.append(k)
            lowest = float(y[k])
    return np.array(kept, dtype=np.intp)
