"""Ripples at an order of the machine: the order is an integer and is not fitted, unless a free one explains more.

What repeats with a shaft repeats a whole number of times per turn. Where a ripple makes a machine stick and slip, a fit
that may also move the order misses it: a small change of the order makes up for a wrong phase.
"""

from collections.abc import Sequence
from dataclasses import replace

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.gates import NEXT_SHARE, SIGMAS, out_of_range
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.choosing.score import Scored
from thsa_cosim.diagnosis.choosing.screen import Proposal
from thsa_cosim.diagnosis.choosing.selection import Say
from thsa_cosim.diagnosis.choosing.verdict import leaves_structure
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.structure import block_gains, consistency, structure
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns, unknowns_of
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights
from thsa_cosim.signals import FloatArray


def first_free_orders(candidates: Sequence[Candidate], current: Fit) -> list[Candidate]:
    """``candidates``, of the further orders of a ripple only the first that is not in the model: they are alike."""
    found: list[Candidate] = []
    offered: set[tuple[str, str]] = set()
    for c in candidates:
        is_new = any(p.scanned and p.variable not in current.unknowns.names for p in c.shapes)
        if c.variant.beside and is_new:
            place = (c.slot.name, c.component)
            if place in offered:
                continue
            offered.add(place)
        found.append(c)
    return found


def on_orders(proposals: Sequence[Proposal], machine: Machine, current: Fit) -> list[Proposal]:
    """``proposals`` whose wave number is an order of the machine hold it; what is in the model already stays."""
    return [_on_order(p, machine, current) for p in proposals] if machine.turns else list(proposals)


def _on_order(proposal: Proposal, machine: Machine, current: Fit) -> Proposal:
    held, shapes = set(), dict(proposal.shapes)
    slot = proposal.candidate.slot.name
    for p in proposal.candidate.shapes:
        if p.scanned and p.variable not in current.unknowns.names:
            order = machine.order(slot, shapes[p.name], 0.0)
            if order is not None:
                shapes[p.name] = order.number * machine.turns[slot][order.part]
                held.add(p.name)
    return replace(proposal, shapes=shapes, held=frozenset(held)) if held else proposal


def freed(
    bench: Bench, weights: ChannelWeights, choice: Scored, found: tuple[Fit, FloatArray], say: Say
) -> tuple[Scored, Fit, FloatArray]:
    """``choice`` with its order fitted, too, where that explains as much as a further effect has to.

    ``found``: the fit of the model with it and its held-out residuals (N,); those that count come back.
    """
    fit, held = found
    if not choice.proposal.held or not leaves_structure(bench, weights, held):
        return choice, *found
    say(f"fitting {choice.candidate.name} with a free order")
    proposal = replace(choice.proposal, held=frozenset())
    own = {u.name: u.spread for u in unknowns_of(proposal.candidate, proposal.shapes)}
    members = [replace(u, spread=own.get(u.name, u.spread)) for u in fit.unknowns.members]
    free = refine(bench, Unknowns(tuple(members)), fit.vector, jacobian=fit.jacobian, steps=fit.steps)
    validate = None if free is None else bench.residuals(free.unknowns, free.vector[None, :], "validate")[0]
    if free is None or validate is None or out_of_range(free):
        return choice, *found
    trials = bench.of("validate")
    before, after = structure(trials, held), structure(trials, validate)
    explains = before - after >= NEXT_SHARE * before
    if not explains or consistency(block_gains(trials, held, validate)) < SIGMAS:
        return choice, *found
    return replace(choice, proposal=proposal, fit=free, validate=validate), free, validate
