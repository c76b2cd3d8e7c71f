"""Parts of an accepted effect that the declared parameters imitate: nothing says that they are zero.

A thread loses one share of its load where it drives and another where it is driven. Half their difference scales the
load, as another torque constant does: where torque is known by the current alone, no recording tells the two apart. The
model goes without such a part; what it may be is part of what is not known of the parameters that imitate it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.diagnosis.catalogue.candidate import CandidateParameter
from thsa_cosim.diagnosis.choosing.attribution import Attribution
from thsa_cosim.diagnosis.choosing.screen import Proposal
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.signals import FloatArray

#: Share of a part's response that the unknowns of the model cannot imitate, below which they stand for it.
IMITATED = 1e-3


@dataclass(frozen=True)
class HiddenPart:
    """A coefficient of ``effect`` that is not in the model, and how large it may be (``size``, in its unit, signed).

    ``moves``: what a part of that size would do to the unknowns of the model, by name, in their units.
    """

    effect: str
    parameter: CandidateParameter
    description: str
    size: float
    moves: Mapping[str, float]


def hidden_parts(found: Attribution) -> tuple[HiddenPart, ...]:
    """The parts of the accepted effects that were not added and that the unknowns of the model imitate."""
    taken = {(s.candidate.variant.block, s.candidate.slot.name) for s in found.accepted}
    parts: dict[str, HiddenPart] = {}
    for one in found.rounds:
        for proposal in one.proposals:
            own = proposal.candidate
            further = own.variant.beside and (own.variant.block, own.slot.name) in taken
            if (
                not further
                or len(own.parameters) != 1
                or own.parameters[0].variable in found.final.unknowns.names
            ):
                continue
            parts.pop(own.key, None)  # a later screening, beside more effects, says more
            if proposal.is_testable and proposal.remaining < IMITATED:
                parts[own.key] = _hidden(proposal, found.final)
    return tuple(parts.values())


def _hidden(proposal: Proposal, fit: Fit) -> HiddenPart:
    """Its size: what the recordings ask for and its standard error, in quadrature.

    The recordings say less by what they leave; the drawing of what imitates the part says its own.
    """
    (parameter,), unknowns = proposal.candidate.coefficients, fit.unknowns
    moves = {name: float(move[0]) for name, move in proposal.moves.items() if name in unknowns.names}
    spreads = dict(zip(unknowns.names, unknowns.precision, strict=True))
    information = recorded = float(proposal.precision[0, 0]) / fit.inflation
    information += sum((spreads[name] * move) ** 2 for name, move in moves.items())
    widest = (parameter.upper - parameter.lower) / np.sqrt(12.0)
    asked = float(proposal.amplitudes[0]) * recorded / information
    size = float(np.copysign(min(np.hypot(asked, 1.0 / np.sqrt(information)), widest), asked))
    description = proposal.candidate.variant.parameters[0].description
    by_size = {name: -move * size for name, move in moves.items()}
    return HiddenPart(proposal.candidate.name, parameter, description, size, by_size)


def widening(parts: Sequence[HiddenPart], fit: Fit) -> FloatArray:
    """(n,) what the parts add to the standard errors of the unknowns of ``fit``, in quadrature."""
    moved = [[part.moves.get(name, 0.0) for name in fit.unknowns.names] for part in parts]
    return np.sqrt(np.sum(np.square(moved), axis=0)) if moved else np.zeros(len(fit.unknowns.names))


def notes_on_hidden(parts: Sequence[HiddenPart], fit: Fit, stderr: FloatArray) -> tuple[str, ...]:
    """A sentence for each part that moves a declared parameter beyond its own standard error (``stderr``, (n,))."""
    notes = []
    for part in parts:
        moved = [
            (u, float(x), part.moves[u.name])
            for u, x, s in zip(fit.unknowns.members, fit.vector, stderr, strict=True)
            if u.declared and abs(part.moves.get(u.name, 0.0)) > s
        ]
        if not moved:
            continue
        surest = max(moved, key=lambda one: abs(one[2] / one[1]) if one[1] else 0.0)
        names = [u.name for u, *_ in moved]
        told = " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
        unit = "" if part.parameter.unit == "1" else f" {part.parameter.unit}"
        unknown, value, move = surest
        apart = unknown.name if len(names) == 1 else "one of them"
        part_text = f"{part.parameter.name} = {part.size:.2g}{unit}"
        notes.append(
            f"{part.effect}: {part.parameter.name}, {part.description}, acts on these recordings as a change of {told}"
            f" does; with {part_text}, {unknown.name} would be {value + move:.4g} in place of {value:.4g}"
            f" {unknown.unit}, which its standard error covers. Measure {apart} apart from the machine"
            " (a torque constant by the back-EMF), and give it that value with a small spread"
        )
    return tuple(notes)
