"""Ripples at an order of the machine: the order is an integer and is not fitted, unless a free one explains more.

What repeats with a shaft repeats a whole number of times per turn. Where a ripple makes a machine stick and slip, a fit
that may also move the order misses it: a small change of the order makes up for a wrong phase.
"""

from collections.abc import Sequence
from dataclasses import replace

from thsa_cosim.diagnosis.choosing.gates import NEXT_SHARE, SIGMAS, SMALLEST_STRUCTURE, out_of_range
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.choosing.score import Scored, with_all_free
from thsa_cosim.diagnosis.choosing.screen import Proposal
from thsa_cosim.diagnosis.choosing.selection import Selection
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.structure import block_gains, consistency, structure


def on_orders(proposals: Sequence[Proposal], machine: Machine, current: Fit) -> list[Proposal]:
    """``proposals`` whose wave number is an order of the machine hold it; what is in the model already stays."""
    return [_on_order(p, machine, current) for p in proposals]


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


def freed(selection: Selection, choice: Scored) -> Scored | None:
    """``choice`` with its order fitted, too, where that explains as much more as a further effect has to; else None."""
    weights, held = selection.weights, choice.proposal.held
    if not held or weights.left(choice.validate) < SMALLEST_STRUCTURE**2:
        return None
    selection.say(f"fitting {choice.candidate.name} with a free order")
    one = with_all_free(selection.bench, choice, selection.current, selection.held)
    trials = selection.bench.of("validate")
    before, after = structure(trials, choice.validate), structure(trials, one.validate)
    explains = before - after >= NEXT_SHARE * before
    certain = consistency(block_gains(trials, choice.validate, one.validate)) >= SIGMAS
    return one if explains and certain and not out_of_range(one.fit) else None
