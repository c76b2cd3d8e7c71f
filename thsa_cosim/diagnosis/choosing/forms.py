"""Other forms of an accepted effect in its place: a better one takes over, those that fit as well make errors larger.

An effect is named by what it does, not by its formula: a drag may grow with the square of the speed or with its power
1.8, a Stribeck curve fall as an exponential or as a fraction. The form bends the other parameters.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.curves import WHOLE, along_exponents
from thsa_cosim.diagnosis.choosing.gates import SIGMAS, insignificant, out_of_range
from thsa_cosim.diagnosis.choosing.score import Scored, polish
from thsa_cosim.diagnosis.choosing.screen import Proposal, propose, shape_starts
from thsa_cosim.diagnosis.choosing.selection import RIVAL_SHARE, RIVAL_WORTH, Selection
from thsa_cosim.diagnosis.fitting.structure import block_gains, consistency


def best_form(
    selection: Selection,
    choice: Scored,
    scored: Sequence[Scored],
    proposals: Sequence[Proposal],
    offered: Sequence[Candidate],
) -> tuple[Scored, tuple[Scored, ...]]:
    """The form of ``choice`` that fits best, and those that fit as well within chance; with all parameters fitted.

    One that is gone on from in another way keeps its form: the others are compared on that way.
    """
    if selection.rough(choice):
        return choice, ()
    choice = along_exponents(selection, choice, choice)
    fitted = [
        s
        for s in (*scored, *selection.fitted(_others(selection, choice, scored, proposals, offered)))
        if is_form(s.candidate, choice.candidate)
    ]
    least = RIVAL_SHARE * choice.fit_gain
    near = [s for s in fitted if s.candidate.variant.instead or s.fit_gain >= least]
    forms = [_polished(selection, s, choice) for s in near]
    limit = choice.fit.inflation
    best = choice
    for one in sorted(forms, key=lambda s: criterion(s, limit)):
        holds = _lead(selection, best, one) < SIGMAS and not insignificant(one) and not out_of_range(one.fit)
        if holds and criterion(one, limit) < criterion(best, limit):
            best = one
    alike = [s for s in (choice, *forms) if s is not best and _lead(selection, best, s) < SIGMAS]
    return best, tuple(alike)


def from_other_starts(selection: Selection, choice: Scored) -> Scored:
    """``choice``, or a better fit of it from another start, where it leaves structure and a positive shape is unknown.

    From a start that is far off, a time constant or a width may leave the range on the wrong side of a hill, whatever
    the response there had promised. Unknown: the standard error is above the value.
    """
    if not selection.is_open([choice]):
        return choice
    fit = choice.fit
    positive = {p.variable for p in choice.candidate.shapes if p.lower > 0.0 and not p.scanned}
    own = [k for k, name in enumerate(fit.unknowns.names) if name in positive]
    if not (fit.stderr(fit.inflation)[own] > fit.vector[own]).any():
        return choice
    rows = [(choice.candidate, starts) for starts in shape_starts(choice.candidate, {}, {})]
    proposals = propose(selection.bench, selection.current, rows)
    others = [p for p in proposals if p.shapes != choice.proposal.shapes]
    fits = [selection.polished(s) for s in selection.fitted(others)[:WHOLE]]
    return min([choice, *fits], key=lambda s: s.fit.cost)


def rivals_forms(
    selection: Selection,
    choice: Scored,
    scored: Sequence[Scored],
    proposals: Sequence[Proposal],
    offered: Sequence[Candidate],
) -> list[Scored]:
    """The best form of every other effect that explains nearly as much as ``choice``, where that is a new fit.

    An effect is no rival by its formula: it is told apart only where its best form is.
    """
    near: dict[str, Scored] = {}
    for other in scored:
        if other.held_out_gain >= RIVAL_SHARE * choice.held_out_gain:
            near.setdefault(other.candidate.name, other)
    found = []
    for other in near.values():
        has_forms = any(c.variant.instead and is_form(c, other.candidate) for c in offered)
        same = other.candidate.effect.name == choice.candidate.effect.name
        if same or not (has_forms or other.candidate.variant.instead):
            continue
        best, _ = best_form(selection, selection.polished(other), scored, proposals, offered)
        if best.proposal is not other.proposal:
            found.append(best)
    return found


def _polished(selection: Selection, one: Scored, choice: Scored) -> Scored:
    """``one`` with all parameters fitted, from the optimum of ``choice`` where it may be a wider form of its block."""
    if one.candidate.component != choice.candidate.component:
        return along_exponents(selection, selection.polished(one), choice)
    values = {**one.fit.unknowns.named(one.fit.vector), **choice.fit.unknowns.named(choice.fit.vector)}
    vector = np.array([values[name] for name in one.fit.unknowns.names])
    start = replace(one, fit=replace(one.fit, vector=vector))
    made = polish(selection.bench, start, selection.current, selection.held)
    return one if made is start else made  # that optimum cannot be simulated with it


def criterion(one: Scored, inflation: float) -> float:
    """Akaike's criterion of a form (IEEE Transactions on Automatic Control 19 (1974) 716), the drawing included.

    ``inflation``: how much less the recordings say than their noise makes them.
    """
    return one.fit.cost / inflation + 2.0 * len(one.fit.vector)


def likelihood(one: Scored, best: Scored) -> float:
    """How likely a model is beside another one, at most 1: by what both leave and how far they are from the drawing."""
    return math.exp(-0.5 * max(0.0, one.fit.cost - best.fit.cost) / best.fit.inflation)


def _others(
    selection: Selection,
    choice: Scored,
    scored: Sequence[Scored],
    proposals: Sequence[Proposal],
    offered: Sequence[Candidate],
) -> list[Proposal]:
    """The best start of every other form that is not fitted yet and promises nearly as much."""
    known = {s.candidate.key for s in scored}
    rows = [
        (candidate, shapes)
        for candidate in offered
        if candidate.variant.instead and is_form(candidate, choice.candidate)
        for shapes in shape_starts(candidate, {}, {})
    ]
    promised = [*propose(selection.bench, selection.current, rows), *proposals] if rows else proposals
    found: dict[str, Proposal] = {}
    for p in sorted(promised, key=lambda p: -p.gain):
        if is_form(p.candidate, choice.candidate) and p.gain >= RIVAL_WORTH * choice.proposal.gain:
            found.setdefault(p.candidate.key, p)
    return [p for key, p in found.items() if key not in known]


def is_form(candidate: Candidate, other: Candidate) -> bool:
    """Whether it is the same effect in the same place by another formula; of ripples the order is no formula."""
    waves = any(p.scanned for p in candidate.parameters)
    return (
        candidate.name == other.name
        and candidate.slot.name == other.slot.name
        and candidate.key != other.key
        and not candidate.variant.beside
        and not waves
    )


def _lead(selection: Selection, one: Scored, other: Scored) -> float:
    """How many standard errors the first explains the held-out recordings better than the other."""
    return consistency(block_gains(selection.bench.of("validate"), other.validate, one.validate))
