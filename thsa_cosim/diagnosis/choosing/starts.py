"""Further starts of an effect's shapes, where those of the catalogue led to no fit that leaves nothing.

A local rise is narrow against the stroke, a Stribeck speed may be anywhere over three decades: from a start too far
off, Gauss-Newton ends in another optimum, and another effect may look better than the true one. The promised gain of
the screening is a function of the shapes alone (the coefficients are eliminated as in variable projection: G. Golub,
V. Pereyra, SIAM Journal on Numerical Analysis 10 (1973) 413), a batch of simulations wide: it is searched by Sobol
points over the shapes' ranges, then around the best of them.
"""

import warnings
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from scipy.stats import qmc

from thsa_cosim.diagnosis.catalogue.candidate import Candidate, CandidateParameter
from thsa_cosim.diagnosis.choosing.screen import Proposal, propose
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.signals import FloatArray

#: Points of the first search (powers of two are balanced), and of each search around the best one, ...
WIDE, CLOSE = 16, 8
#: ... whose range is this share of the one before.
ZOOMS = (0.35, 0.12)
#: Candidates whose shapes are searched, if they promise this share of the best one's gain.
SEARCHED, PROMISING = 4, 0.1


def further_starts(bench: Bench, base: Fit, proposals: Sequence[Proposal]) -> list[Proposal]:
    """Proposals at further starts of the most promising candidates' shapes, best first.

    Wave numbers are left out: their starts come from a periodogram, as fine as the recordings are long.
    """
    best = _best(p for p in proposals if _searchable(p.candidate, base))
    least = PROMISING * max((p.gain for p in proposals), default=0.0)
    chosen = sorted((p for p in best.values() if p.gain >= least), key=lambda p: -p.gain)[:SEARCHED]
    best = {p.candidate.key: p for p in chosen}
    found: list[Proposal] = []
    for share in (1.0, *ZOOMS):
        count = WIDE if share == 1.0 else CLOSE
        rows = [
            (p.candidate, s)
            for p in best.values()
            for s in points_around(p.candidate, p.shapes, share, count)
        ]
        found += propose(bench, base, rows)
        best = _best([*chosen, *found])
    return sorted(found, key=lambda p: -p.gain)


def points_around(
    candidate: Candidate, centre: Mapping[str, float], share: float, count: int
) -> list[dict[str, float]]:
    """``count`` Sobol points over ``share`` of the ranges of the candidate's shapes, about ``centre``.

    A range that is positive throughout is searched by its logarithm.
    """
    shapes = candidate.shapes
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of a count that is no power of two
        unit = qmc.Sobol(len(shapes), scramble=False).random(count + 1)[1:]  # the first one is the corner
    columns = {p.name: _scaled(p, centre[p.name], share, unit[:, k]) for k, p in enumerate(shapes)}
    return [{**centre, **{n: float(c[k]) for n, c in columns.items()}} for k in range(count)]


def _scaled(p: CandidateParameter, centre: float, share: float, unit: FloatArray) -> FloatArray:
    low, high = p.lower, p.upper
    if low > 0.0:
        low, high, centre = np.log(low), np.log(high), np.log(centre)
    half = 0.5 * share * (high - low)
    begin = float(np.clip(centre - half, low, max(low, high - 2.0 * half)))
    values = begin + 2.0 * half * unit
    return np.asarray(np.exp(values) if p.lower > 0.0 else values)


def _searchable(candidate: Candidate, base: Fit) -> bool:
    known: Mapping[str, float] = base.unknowns.named(base.vector)
    free = [p for p in candidate.shapes if p.variable not in known]
    return bool(free) and len(free) == len(candidate.shapes) and not any(p.scanned for p in free)


def _best(proposals: Iterable[Proposal]) -> dict[str, Proposal]:
    found: dict[str, Proposal] = {}
    for p in sorted(proposals, key=lambda p: -p.gain):
        found.setdefault(p.candidate.key, p)
    return found
