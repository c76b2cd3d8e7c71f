"""Starts of an effect's size, where the linear response at none of it leads astray.

A thread that locks itself loses more than its whole load: without it a model runs away or rests, declared parameters go
to the ends of their ranges to make up for that, and neither their Jacobian nor the response to a little friction says
what much of it would do. So the size is tried over decades, the declared parameters as fitted and as drawn.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thsa_cosim.diagnosis.choosing.gates import out_of_range
from thsa_cosim.diagnosis.choosing.score import Scored, refit
from thsa_cosim.diagnosis.choosing.screen import Proposal
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, cost_of
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns, unknowns_of
from thsa_cosim.signals import FloatArray

#: Sizes tried, in multiples of the ordinary one, ...
SIZES = (10.0, 30.0, 100.0, 300.0, 1000.0)
#: ... of so many effects and places, those that promise most, of which so many are fitted.
TRIED, FITTED = 8, 3
#: Sizes are tried where no fit explains this share of the structure and a declared parameter is far from the
#: drawing or at the end of its range, ...
HARDLY = 0.5
#: ... and fitted where one of them leaves this share of the squared residuals.
WORTH = 0.7
#: Sizes grow until one leaves so many times the squared residuals of the one before: a machine that is stuck gets no
#: better by more of it, and is slow to simulate. Set beforehand.
RISEN = 3.0


def is_led_astray(base: Fit, scored: Sequence[Scored]) -> bool:
    """Whether the declared parameters make up for something that no fit of an effect explains."""
    bent = bool(out_of_range(base)) or base.unknowns.is_far(base.vector)
    return bent and all(s.share < HARDLY for s in scored)


def at_sizes(bench: Bench, base: Fit, held: FloatArray, proposals: Sequence[Proposal]) -> list[Scored]:
    """The candidates among ``proposals`` (best first) that a larger size serves, fitted from there."""
    begun: list[tuple[float, Proposal, Unknowns, FloatArray]] = []
    for proposal in _simplest(proposals):
        own = unknowns_of(proposal.candidate, proposal.shapes, proposal.held)
        unknowns = base.unknowns.with_members([u for u in own if u.name not in base.unknowns.names])
        vectors, costs = _tried(bench, unknowns, _rows(base, unknowns, proposal))
        best = int(np.argmin(costs))
        if costs[best] < WORTH * base.cost:
            # A copy: of the fits of one proposal, `Selection` polishes one and keeps it for all.
            begun.append((costs[best], replace(proposal), unknowns, vectors[best]))
    begun.sort(key=lambda one: one[0])
    fits = [refit(bench, p, base, held, unknowns, vector) for _, p, unknowns, vector in begun[:FITTED]]
    return [s for s in fits if s is not None]


def _simplest(proposals: Sequence[Proposal]) -> list[Proposal]:
    """The best proposal of one coefficient of every effect in every place, no ripples: their size is bounded."""
    found: dict[str, Proposal] = {}
    for p in proposals:
        candidate = p.candidate
        plain = len(candidate.coefficients) == 1 and not any(q.scanned for q in candidate.parameters)
        if plain and p.is_testable:
            found.setdefault(candidate.name, p)
    return list(found.values())[:TRIED]


def _tried(
    bench: Bench, unknowns: Unknowns, rows: Sequence[Sequence[FloatArray]]
) -> tuple[list[FloatArray], list[float]]:
    """The vectors of every row, sizes growing, as far as they help, and their costs; infinite where a run failed."""
    vectors: list[FloatArray] = []
    costs: list[float] = []
    before = dict.fromkeys(range(len(rows)), np.inf)
    for size in range(len(SIZES)):
        going = [k for k in before if size < len(rows[k])]
        if not going:
            break
        asked = [rows[k][size] for k in going]
        found = bench.residuals(unknowns, np.array(asked), "fit")
        own = [np.inf if r is None else cost_of(unknowns, v, r) for v, r in zip(asked, found, strict=True)]
        vectors += asked
        costs += own
        before = {k: cost for k, cost in zip(going, own, strict=True) if cost <= RISEN * before[k]}
    return vectors, costs


def _rows(base: Fit, unknowns: Unknowns, proposal: Proposal) -> list[list[FloatArray]]:
    """The sizes in the direction that the screening promises, growing: a row from the fit, one from the drawing."""
    (coefficient,) = proposal.candidate.coefficients
    known = base.vector.size
    drawn = np.where([u.declared for u in base.unknowns.members], base.unknowns.start, base.vector)
    sign = np.sign(proposal.amplitudes[0]) or 1.0
    if coefficient.lower >= coefficient.neutral:
        sign = 1.0
    k = unknowns.names.index(coefficient.variable)
    rows = []
    for start in (base.vector, drawn):
        row: dict[tuple[float, ...], FloatArray] = {}
        for size in SIZES:
            vector = unknowns.start
            vector[:known] = start
            vector[k] = coefficient.neutral + sign * size * abs(coefficient.typical)
            held = unknowns.clip(vector)
            row.setdefault(tuple(held), held)
        rows.append(list(row.values()))
    return rows[:1] if np.array_equal(base.vector, drawn) else rows
