"""An attribution in the words of the result."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from thsa_cosim.diagnosis.catalogue.declared import DeclaredEffect
from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.diagnosis.choosing.attribution import Attribution, round_of
from thsa_cosim.diagnosis.choosing.orders import NO_MACHINE, Machine, Order, name_by_order
from thsa_cosim.diagnosis.choosing.rounds import Round
from thsa_cosim.diagnosis.choosing.score import Scored
from thsa_cosim.diagnosis.choosing.screen import Proposal
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.unknowns import FAR, Unknown
from thsa_cosim.diagnosis.results import FoundEffect, Judged, KnownEffect, Value
from thsa_cosim.signals import FloatArray

#: An error above this share of its value leaves it open; one above this share of the drawing's is the drawing's.
CLEAR, NO_MORE = 1.0 / 3.0, 0.95
#: What would not be seen at this many times its ordinary size cannot be tested.
HUGE = 10.0


def values_of(fit: Fit, *, declared: bool, stderr: FloatArray | None = None) -> dict[str, Value]:
    """The declared parameters (or the others) of a fit with standard errors ``stderr`` (n,).

    Default: those of white residuals, widened by what it leaves; enough for what is only listed.
    """
    stderr = fit.stderr(fit.inflation) if stderr is None else stderr
    return {
        u.name: Value(float(x), u.unit, float(s), undetermined(u, float(x), float(s)))
        for u, x, s in zip(fit.unknowns.members, fit.vector, stderr, strict=True)
        if u.declared is declared
    }


def undetermined(unknown: Unknown, value: float, stderr: float) -> str:
    """Why the recordings do not determine an unknown, or ""; how large an effect's parameter is says `vague`."""
    if not unknown.lower < value < unknown.upper:
        unit = "" if unknown.unit in ("", "1") else f" {unknown.unit}"
        return f"it ended at the end of its range, {value:.6g}{unit}"
    if not np.isfinite(stderr):
        return "nothing in the recordings determines it"
    if unknown.declared and stderr > NO_MORE * unknown.spread:
        return "the recordings say no more of it than the drawing"
    return ""


def off_the_drawing(fit: Fit) -> tuple[str, ...]:
    """Which declared parameters the recordings move by more than `FAR` spreads from the drawing, the farthest first."""
    apart = np.abs(fit.unknowns.prior(fit.vector))
    far = [k for k in np.argsort(-apart) if apart[k] > FAR]
    members = [(fit.unknowns.members[k], float(fit.vector[k]), float(apart[k])) for k in far]
    return tuple(
        f"{u.name}: {value:.4g} {u.unit} is {times:.0f} times its spread from the drawing's {u.start:.4g} {u.unit}"
        for u, value, times in members
    )


def vague(members: Sequence[Scored], values: Mapping[str, Value]) -> dict[str, Value]:
    """``values`` by variable, with a reason for what in an effect's ``members`` is less than its error tells apart.

    A coefficient counts against the largest of its unit: the sine of a ripple may well be zero beside its cosine.
    """
    parameters = {p.variable: p for s in members for p in s.candidate.parameters if p.variable in values}
    sizes: dict[str, float] = {}
    for variable, p in parameters.items():
        if p.role == "coefficient":
            moved = abs(values[variable].value - p.neutral)
            sizes[p.unit] = max(sizes.get(p.unit, 0.0), moved)
    found = {}
    for variable, p in parameters.items():
        one = values[variable]
        size = sizes[p.unit] if p.role == "coefficient" else max(abs(one.value), abs(p.typical))
        if not one.reason and one.stderr > CLEAR * size:
            one = replace(
                one, reason=f"it is not determined: one standard error is {one.stderr:.2g} {one.unit}"
            )
        found[variable] = one
    return found


def found_effects(
    found: Attribution, fit: Fit, machine: Machine = NO_MACHINE, stderr: FloatArray | None = None
) -> tuple[FoundEffect, ...]:
    """The accepted effects with the values of the extended model; variants and places of one effect are one.

    ``stderr`` (n,): of the unknowns of ``fit``, as in `values_of`.
    """
    merged: dict[str, list[Scored]] = {}
    for scored in found.accepted:
        merged.setdefault(scored.candidate.effect.name, []).append(scored)
    values = values_of(fit, declared=False, stderr=stderr)
    effects = []
    for members in merged.values():
        owner = round_of(found, members[0])
        order = order_of(members[0], values, machine)
        name = _named(members[0], order)
        # What is in the model with it is nothing that could be there in its place.
        others = merged.keys() - {members[0].candidate.effect.name}
        apart = [r for r in owner.rivals if r.candidate.effect.name not in others]
        rivals = tuple(r for r in dict.fromkeys(_rival_name(r, machine) for r in apart) if r != name)
        chance = owner.probability(members[0].fit_gain)
        effects.append(
            FoundEffect(
                name=name,
                title=_title(members[0], name),
                parameters=_parameters(members, vague(members, values)),
                equivalent=rivals,
                probability=(1.0 - chance) / (1 + len(rivals)),
                order=_orders([o for m in members if (o := order_of(m, values, machine))]),
            )
        )
    return tuple(effects)


def known_values(known: Sequence[DeclaredEffect], fit: Fit, stderr: FloatArray) -> tuple[KnownEffect, ...]:
    """The effects of the declared model with the values of ``fit``, whose unknowns err by ``stderr`` (n,)."""
    values = values_of(fit, declared=True, stderr=stderr)
    found: dict[str, dict[str, Value]] = {}
    for effect in known:
        for p in effect.candidate.parameters:
            given = Value(effect.starts[p.name], p.unit, 0.0)
            own = replace(values.get(p.variable, given), variable=p.variable, role=p.role)
            found.setdefault(effect.candidate.name, {})[p.name] = own
    return tuple(KnownEffect(name, parameters) for name, parameters in found.items())


def order_of(scored: Scored, values: Mapping[str, Value], machine: Machine) -> Order | None:
    """The order of a ripple in the machine; None for what does not repeat, or over no shaft's turn."""
    for p in scored.candidate.parameters:
        if p.scanned:
            wave = values.get(p.variable, Value(scored.proposal.shapes.get(p.name, 0.0), p.unit, 0.0))
            return machine.order(scored.candidate.slot.name, wave.value, wave.stderr)
    return None


def _orders(orders: Sequence[Order]) -> str:
    """``12, 18 per turn of the motor``."""
    parts: dict[str, dict[int, None]] = {}
    for order in orders:
        parts.setdefault(order.part, {})[order.number] = None
    return "; ".join(f"{', '.join(map(str, n))} per turn of the {part}" for part, n in parts.items())


def _named(scored: Scored, order: Order | None) -> str:
    # What the phases do keeps its name: its order is a multiple of the pole pairs, and no torque.
    phases = scored.candidate.slot.interface == "PhaseEffect"
    ripple = not phases and any(p.scanned for p in scored.candidate.parameters)
    return name_by_order(scored.candidate, order) if ripple else scored.candidate.name


def _rival_name(rival: Scored, machine: Machine) -> str:
    return _named(rival, order_of(rival, values_of(rival.fit, declared=False), machine))


def _title(scored: Scored, name: str) -> str:
    effect = name.split(":")[0]
    return scored.candidate.effect.title if scored.candidate.name == name else known_effects()[effect].title


def _parameters(members: list[Scored], values: Mapping[str, Value]) -> dict[str, Value]:
    """By name, with slot and block where an effect acts in several ways; what is given, not fitted, has no error."""
    given = {
        p.variable: Value(s.proposal.shapes[p.name], p.unit, 0.0)
        for s in members
        for p in s.candidate.parameters
        if p.fixed or p.name in s.proposal.held
    }
    values = {**values, **given}
    ways = {s.candidate.component + s.candidate.slot.name for s in members}
    return {
        p.name if len(ways) == 1 else p.variable: replace(
            values[p.variable], variable=p.variable, role=p.role
        )
        for s in members
        for p in s.candidate.parameters
        if p.variable in values
    }


def judged(found: Attribution) -> tuple[Judged, ...]:
    """Every candidate's best proposal in each round, most telling first."""
    made: list[Judged] = []
    for number, one in enumerate(found.rounds, start=1):
        kept = one.accepted is not None and one.accepted in found.accepted
        rivals = {r.candidate.key for r in one.rivals} if kept else set()
        # Of a rival the fit that makes it one, with all parameters.
        refined = {id(s.proposal): s for s in (*one.scored, *one.rivals)}
        seen: set[str] = set()
        winner = None if one.accepted is None else one.accepted.proposal
        ordered = sorted(one.proposals, key=lambda p: (p is not winner, id(p) not in refined, -p.gain))
        for proposal in ordered:
            key = proposal.candidate.key
            if key in seen:
                continue
            seen.add(key)
            made.append(_judge(found, one, number, proposal, refined.get(id(proposal)), rivals))
    return tuple(made)


def _judge(
    found: Attribution,
    one: Round,
    number: int,
    proposal: Proposal,
    scored: Scored | None,
    rivals: set[str],
) -> Judged:
    candidate = proposal.candidate
    accepted = any(s.proposal is proposal for s in found.accepted)
    values = _values(proposal, scored)
    gain = proposal.gain if scored is None else scored.fit_gain
    decision, reason = "not refined", "promises no more than chance"
    if proposal.gain >= one.threshold:
        reason = "promises less than those that were refined"
    if _not_testable(proposal, one.threshold):
        decision, reason = "not testable", "too little excitation beside the declared parameters"
        if not proposal.is_testable:
            reason = "nothing in the fit recordings depends on it"
    if scored is not None:
        decision = "accepted" if accepted else "rival" if candidate.key in rivals else "rejected"
        reason = ""
        if decision == "rejected":
            reason = _objection(found, one, scored)
        elif decision == "rival":
            reason = "explains the held-out recordings as well, within the uncertainty"
    return Judged(
        name=candidate.name,
        variant=proposal.label,
        fit_gain=gain,
        held_out_gain=None if scored is None else scored.held_out_gain,
        p_value=one.probability(gain),
        parameters=values,
        decision=decision,  # type: ignore[arg-type]
        reason=reason,
        round=number,
    )


def _objection(found: Attribution, one: Round, scored: Scored) -> str:
    """Why a refined candidate was not accepted: its own objection if it was tried, else what came before it."""
    tried = dict(zip(map(id, one.scored), one.objections, strict=False))
    if tried.get(id(scored)):
        return tried[id(scored)]
    if one.accepted is not None and one.accepted.proposal is scored.proposal:
        return "was accepted and dropped again, see the notes"
    later = _accepted_later(found, one, scored)
    if later:
        return later
    if one.accepted is None:
        return one.objections[0]
    return f"explains the held-out recordings less well than {one.accepted.candidate.name}"


def _accepted_later(found: Attribution, one: Round, scored: Scored) -> str:
    """Whether a further round accepted the candidate that this one did not."""
    for number, other in enumerate(found.rounds, start=1):
        kept = other.accepted is not None and any(
            s.proposal is other.accepted.proposal for s in found.accepted
        )
        if kept and other is not one and other.accepted.candidate.key == scored.candidate.key:  # type: ignore[union-attr]
            return f"explains the held-out recordings less well; accepted in round {number}"
    return ""


def _values(proposal: Proposal, scored: Scored | None) -> Mapping[str, Value]:
    if scored is not None:
        found = values_of(scored.fit, declared=False)
        return {p.name: found[p.variable] for p in proposal.candidate.parameters if p.variable in found}
    return {
        p.name: Value(p.neutral + float(a), p.unit, float(s))
        for p, a, s in zip(proposal.candidate.coefficients, proposal.amplitudes, proposal.stderr, strict=True)
    }


def _not_testable(proposal: Proposal, threshold: float) -> bool:
    """Whether even a coefficient ``HUGE`` times as large as usual would drown in chance."""
    typical = np.array([p.typical for p in proposal.candidate.coefficients])
    return bool(np.all(np.sqrt(threshold) * proposal.stderr > HUGE * np.abs(typical)))
