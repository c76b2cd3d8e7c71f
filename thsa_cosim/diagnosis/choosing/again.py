"""Rivals of an accepted effect, asked again once all that was found after it is in the model.

While another effect is missing, two that explain nearly the same are told apart by what each takes up of that. So what
was a tie of an accepted effect, or lost to it by one fit recording only, is put in its place in the whole model.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np

from thsa_cosim.diagnosis.choosing.gates import SIGMAS, insignificant, out_of_range
from thsa_cosim.diagnosis.choosing.needless import further_parts
from thsa_cosim.diagnosis.choosing.rounds import APART, Round, number_of, taken_over
from thsa_cosim.diagnosis.choosing.score import Scored, extended_unknowns
from thsa_cosim.diagnosis.choosing.selection import TIE_SHARE, Say
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.structure import block_gains, consistency
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.signals import FloatArray

#: At most so many rivals of an accepted effect are asked again, the most telling first.
ASKED = 2


@dataclass(frozen=True, eq=False)
class Model:
    """The ``rounds``, the effects ``accepted`` in them, the model's ``fit`` with them, its held-out residuals (N,)."""

    rounds: tuple[Round, ...]
    accepted: tuple[Scored, ...]
    fit: Fit
    held: FloatArray


def asked_again(bench: Bench, unknowns: Unknowns, model: Model, say: Say) -> Model:
    """``model``, whose effects were each compared with their rivals while all later ones were in.

    A rival that fits better, by three standard errors, and explains the held-out recordings as well takes the effect's
    place; one that fits as well, but for a small share of what the effect explains, is a tie. ``unknowns``: of the
    declared model.
    """
    for one in model.accepted[:-1]:
        number = number_of(model.rounds, one)
        others = [s for s in model.accepted if s is not one]
        rivals = _near(model.rounds[number], one, others)
        if not rivals or further_parts(one.candidate, [s.candidate for s in others]):
            continue
        say(f"comparing {one.candidate.name} with its rivals again")
        found = [s for rival in rivals if (s := _in_place(bench, unknowns, model, one, rival)) is not None]
        model = _decided(model, number, one, rivals, found)
    return model


def _near(kept: Round, one: Scored, others: Sequence[Scored]) -> list[Scored]:
    """Other effects that tied with ``one`` in its round, or lost by a fit recording; none of the ``others`` kept."""
    named = {s.candidate.effect.name for s in (one, *others)}
    lost = [s for s, why in zip_longest(kept.scored, kept.objections) if s is not None and why == APART]
    found: dict[str, Scored] = {}
    for s in sorted([*kept.rivals, *lost], key=lambda s: -s.held_out_gain):
        if s.candidate.effect.name not in named:
            found.setdefault(s.candidate.name, s)
    return list(found.values())[:ASKED]


def _in_place(bench: Bench, unknowns: Unknowns, model: Model, one: Scored, rival: Scored) -> Scored | None:
    """``rival`` in the place of ``one`` in the whole model, fitted; None if that is no model or explains less."""
    kept = [rival if s is one else s for s in model.accepted]
    wider = extended_unknowns(unknowns, kept)
    # What was missing beside the rival bent the declared parameters: those of the whole model are nearer.
    known = {**rival.fit.unknowns.named(rival.fit.vector), **model.fit.unknowns.named(model.fit.vector)}
    start = [known[name] for name in wider.names]
    fit = refine(bench, wider, np.array(start), enough=3.0, to_beat=model.fit.cost)
    if fit is None or fit.cost > model.fit.cost + _worth(model, one) or out_of_range(fit):
        return None
    (held,) = bench.residuals(wider, fit.vector[None, :], "validate")
    if held is None:
        return None
    lead = block_gains(bench.of("validate"), held, model.held)
    if consistency(lead) >= SIGMAS and float(np.sum(lead)) >= _worth(model, one):
        return None
    found = replace(rival, fit=fit, validate=held)
    return None if insignificant(found) else found


def _margin(model: Model) -> float:
    """What two costs may differ by within chance."""
    return SIGMAS**2 * model.fit.inflation


def _worth(model: Model, one: Scored) -> float:
    """By how much a rival of ``one`` may fit worse and be its tie: within chance, or a share of what that explains."""
    return max(_margin(model), TIE_SHARE * one.held_out_gain)


def _decided(
    model: Model, number: int, one: Scored, asked: Sequence[Scored], found: Sequence[Scored]
) -> Model:
    """``model`` with what was ``found`` of the ``asked`` to explain as much as ``one``, of round ``number``.

    What was asked and not found is no tie any more.
    """
    kept, fit, held = model.rounds[number], model.fit, model.held
    names = {s.candidate.name for s in asked}
    ties = tuple(r for r in kept.rivals if r.candidate.name not in names)
    best = one
    if found:  # all are compared as they are now
        best = min(found, key=lambda s: s.fit.cost)
        fit, held = best.fit, best.validate
        if fit.cost > model.fit.cost - _margin(model):
            best, fit, held = replace(one, fit=model.fit, validate=model.held), model.fit, model.held
    if best.proposal is one.proposal:
        kept = replace(kept, accepted=best, rivals=(*ties, *found))
    else:
        scored, objections = taken_over(best, kept.scored, kept.objections)
        near = tuple(s for s in found if s is not best and s.fit.cost <= fit.cost + _worth(model, one))
        kept = replace(
            kept, accepted=best, scored=tuple(scored), objections=objections, rivals=near, forms=()
        )
    rounds = (*model.rounds[:number], kept.folded, *model.rounds[number + 1 :])
    return Model(rounds, tuple(best if s is one else s for s in model.accepted), fit, held)
