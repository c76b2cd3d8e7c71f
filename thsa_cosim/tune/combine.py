"""From the terms of many responses to one cost: conditions combined, requirements applied.

A vector that breaks a hard requirement is infeasible: its cost is ``INFEASIBLE`` times one plus the excess,
above any cost of a feasible one, and still lower the nearer it comes (Deb, 2000), so that a search finds its
way in. A soft requirement adds its penalty times the excess to the cost.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.scenario import TuneScenario
from thsa_cosim.scenario.tune_model import Requirement
from thsa_cosim.signals import FloatArray

INFEASIBLE = 1e9
#: Excess of a metric that does not exist (a level never reached, a band never kept).
UNDEFINED = 100.0
#: Terms of which less is worse.
SMALLEST = ("gain_margin", "phase_margin", "breakaway_margin", "current_reserve", "voltage_reserve")


@dataclass(frozen=True, eq=False)
class Combined:
    """One vector over its conditions.

    ``cost`` what the search minimises; ``eq7`` equation 7 alone, combined; ``worst`` (q,) the worst of each
    term; ``excess`` (r,) of each requirement, 0 where it is met by all conditions.
    """

    cost: float
    eq7: float
    worst: FloatArray
    excess: FloatArray
    feasible: bool


def equation_7(scenario: TuneScenario, names: Sequence[str], terms: FloatArray) -> FloatArray:
    """J = Σ ½ (v - v̂)² + κ1 t_r + κ2 |e_ss| (c,) from terms (c, q); NaN where a term that counts is undefined."""
    cost = scenario.cost
    tracking, rise, steady = (
        terms[:, names.index(n)] for n in ("tracking", "rise_time", "steady_state_error")
    )
    size = steady if cost.signed else np.abs(steady)
    total = tracking.copy()
    # A recorded profile may end at rest: it has no rise and no steady state, and no weight on them.
    for weight, term in ((cost.kappa_rise, rise), (cost.kappa_steady, size)):
        if weight > 0.0:
            total = total + weight * term
    return np.asarray(total)


def worst_of(names: Sequence[str], terms: FloatArray) -> FloatArray:
    """Worst of each term (q,) over terms (c, q): the largest, e_ss by its size with its sign, margins smallest.

    NaN (undefined) is worst of all.
    """
    found = np.empty(len(names))
    for k, name in enumerate(names):
        column = terms[:, k]
        if np.isnan(column).any():
            found[k] = np.nan
        elif name in SMALLEST:
            found[k] = np.min(column)
        elif name == "steady_state_error":
            found[k] = column[int(np.argmax(np.abs(column)))]
        else:
            found[k] = np.max(column)
    return found


def excess_of(requirement: Requirement, values: FloatArray) -> FloatArray:
    """How far values (c,) break a requirement, in its scale (c,); 0 where they keep it."""
    size = np.abs(values) if requirement.metric == "steady_state_error" else values
    over = (size - requirement.limit) if requirement.upper else (requirement.limit - size)
    over = np.where(np.isnan(size), UNDEFINED * requirement.scale, over)
    return np.asarray(np.minimum(np.maximum(over, 0.0) / requirement.scale, UNDEFINED))


def combine(
    scenario: TuneScenario,
    names: Sequence[str],
    terms: FloatArray,
    weights: FloatArray,
    requirements: Sequence[Requirement],
) -> Combined:
    """Combine the terms (c, q) of one vector's conditions with ``weights`` (c,) under ``requirements``."""
    per_condition = equation_7(scenario, names, terms)
    if scenario.combine == "worst":
        eq7 = float(np.max(per_condition))
    else:
        eq7 = float(np.sum(weights * per_condition) / np.sum(weights))
    excess = np.array(
        [float(np.max(excess_of(r, terms[:, names.index(r.name)]))) for r in requirements], dtype=np.float64
    )
    hard = np.array([r.hard for r in requirements], dtype=np.bool_)
    soft = sum(r.penalty * x for r, x in zip(requirements, excess.tolist(), strict=True) if not r.hard)
    broken = float(np.sum(excess[hard])) if hard.any() else 0.0
    cost = INFEASIBLE * (1.0 + broken) if broken > 0.0 else eq7 + soft
    if np.isnan(eq7):
        cost = cost if broken > 0.0 else np.inf
    return Combined(float(cost), eq7, worst_of(names, terms), excess, broken == 0.0 and not np.isnan(eq7))
