"""Where else an accepted effect may be: behind a rigid gear the same law acts at the other shaft.

The screening refines an effect in every place that promises as much, but what is found in step, by another form, or
beside an effect that is dropped again, has no such rivals. So each accepted effect is tried at every shaft that turns
with its own.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.gates import SIGMAS
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.choosing.score import Scored
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.structure import block_gains, consistency
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns, unknowns_of
from thsa_cosim.signals import FloatArray


def shaft_scales(ratio: float) -> dict[str, float]:
    """What the scales of a place change by at a shaft that turns ``ratio`` times as far: power stays what it is."""
    return {"V": ratio, "Z": ratio, "D": ratio, "W": 1.0 / ratio, "F": 1.0 / ratio}


def is_same_law(one: Candidate, other: Candidate) -> bool:
    """Whether it is the same form of the same effect at another shaft: behind a rigid gear nothing tells them apart."""
    shafts = one.slot.is_angular and other.slot.is_angular
    return other.variant is one.variant and other.slot.name != one.slot.name and shafts


def tied_places(
    bench: Bench, one: Scored, final: Fit, held: FloatArray, candidates: Sequence[Candidate], machine: Machine
) -> list[Scored]:
    """``one`` at other shafts, where the ``final`` model with it there explains the recordings as well.

    ``held`` (N,): held-out residuals of ``final``. Each comes with the fit of ``one``, in the other shaft's units.
    """
    own = one.candidate
    ratios = machine.turns.get(own.slot.name, {})
    found = []
    for other in candidates:
        turns = other.slot.name in ratios and is_same_law(own, other)
        if not turns or any(p.fixed for p in own.parameters):
            continue
        shaft = shaft_scales(ratios[other.slot.name])
        moved, there = at_shaft(one, other, shaft, one.fit), at_shaft(one, other, shaft, final)
        if moved is not None and there is not None and _explains(bench, there, final, held):
            found.append(moved)
    return found


def at_shaft(one: Scored, other: Candidate, shaft: dict[str, float], fit: Fit) -> Scored | None:
    """``one`` with its parameters in ``fit`` as the same law has them at another shaft; None beyond their ranges."""
    factors = {p.name: p.scale(shaft) for p in other.variant.parameters}
    shapes = {name: value * factors[name] for name, value in one.proposal.shapes.items()}
    added = {u.name: u for u in unknowns_of(other, shapes, one.proposal.held)}
    theirs = {p.variable: q for p in one.candidate.parameters for q in other.parameters if p.name == q.name}
    members, vector, jacobian = list(fit.unknowns.members), fit.vector.copy(), fit.jacobian.copy()
    for k, member in enumerate(fit.unknowns.members):
        if member.name in theirs:
            there = theirs[member.name]
            members[k] = added[there.variable]
            vector[k] *= factors[there.name]
            jacobian[:, k] *= members[k].scale / member.scale / factors[there.name]
            if not members[k].lower <= vector[k] <= members[k].upper:
                return None
    moved = replace(fit, unknowns=Unknowns(tuple(members)), vector=vector, own=jacobian, shared=None)
    return replace(one, proposal=replace(one.proposal, candidate=other, shapes=shapes), fit=moved)


def _explains(bench: Bench, there: Scored, final: Fit, held: FloatArray) -> bool:
    """Whether the model with the effect ``there`` fits as well as the ``final`` one, the held-out recordings too."""
    unknowns = there.fit.unknowns
    fit = refine(
        bench,
        unknowns,
        there.fit.vector,
        jacobian=there.fit.jacobian,
        fresh=unknowns.index([p.variable for p in there.candidate.parameters]),
        near=True,
        iterations=2,
        enough=3.0,
    )
    if fit is None or fit.cost > final.cost + SIGMAS**2 * final.inflation:
        return False
    (validate,) = bench.residuals(unknowns, fit.vector[None, :], "validate")
    if validate is None:
        return False
    lead = block_gains(bench.of("validate"), validate, held)
    return consistency(lead) < SIGMAS or float(np.sum(lead)) < SIGMAS**2
