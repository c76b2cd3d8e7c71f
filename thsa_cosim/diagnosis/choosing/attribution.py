"""Which effects the recordings ask for: screen, refine, score on held-out recordings, accept one, and again.

Forward selection (each step against the model so far, declared parameters fitted along), then every accepted
effect must still be needed beside the others.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.chance import largest_gains, probability, threshold
from thsa_cosim.diagnosis.choosing.gates import (
    SIGMAS,
    SMALLEST_STRUCTURE,
    insignificant,
    near_best,
    objection,
    out_of_range,
)
from thsa_cosim.diagnosis.choosing.score import Scored, extended_unknowns, go_on, polish, score
from thsa_cosim.diagnosis.choosing.screen import Proposal, screen
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, cost_of, refine
from thsa_cosim.diagnosis.fitting.structure import block_gains, consistency
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights
from thsa_cosim.signals import FloatArray

#: Rivals that leave less than this share of the gain unexplained cannot be told apart.
TIE_SHARE = 0.005
#: How many effects are refined after each screening, if they promise at least this share of the best one's gain.
REFINED, WORTH = 6, 0.03
#: Once an effect leaves no structure, only those that promise this share of its gain are refined as rivals; and only
#: those that reach this share of the best gain in two iterations are refined further.
RIVAL_WORTH = 0.3

Scan = Callable[[Fit], Mapping[str, Sequence[float]]]
Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Round:
    """One screening: its threshold, what was proposed, what was refined (best first) and what was decided.

    ``objections``: why each of the first refined ones was not accepted, "" for the one that was. ``rivals``: other
    effects that explain the held-out recordings as well as the accepted one, within the uncertainty. ``factors`` (N,):
    how the residuals of the fit recordings were weighed.
    """

    threshold: float
    proposals: tuple[Proposal, ...]
    scored: tuple[Scored, ...]
    accepted: Scored | None
    objections: tuple[str, ...]
    rivals: tuple[Scored, ...]
    gains: FloatArray
    factors: FloatArray

    def probability(self, gain: float) -> float:
        """Probability that chance makes at least ``gain``."""
        return probability(gain, self.gains)


@dataclass(frozen=True, eq=False)
class Attribution:
    """The declared model's fit, the rounds, the accepted effects in order, and the model with them.

    ``base_cost``: of the declared model's fit without weights, the prior's share included.
    ``base_validate``, ``final_validate`` (N,): held-out residuals of both, in standard deviations of the noise.
    """

    base: Fit
    base_cost: float
    rounds: tuple[Round, ...]
    accepted: tuple[Scored, ...]
    final: Fit
    base_validate: FloatArray
    final_validate: FloatArray
    notes: tuple[str, ...] = field(default=())


def attribute(
    bench: Bench,
    unknowns: Unknowns,
    candidates: Sequence[Candidate],
    scan: Scan,
    *,
    start: FloatArray | None = None,
    seed: int,
    most: int = 3,
    say: Say = lambda _: None,
) -> Attribution | None:
    """Find the effects, the declared parameters from ``start`` (default: the drawing); None if that does not run."""
    say("fitting the declared model")
    base = refine(bench, unknowns, unknowns.start if start is None else start, iterations=10)
    if base is None:
        return None
    weights = ChannelWeights(bench)
    base, held = weights.weigh(base)
    if held is None:
        return None
    base_cost = cost_of(unknowns, base.vector, weights.plain(base.residual, "fit"))
    weights.base_held = held
    current, current_held = base, held
    rounds: list[Round] = []
    accepted: list[Scored] = []
    for number in range(most):
        if accepted and weights.left(current_held) < SMALLEST_STRUCTURE**2:
            break
        say(
            f"screening {len(candidates)} candidates"
            + (f" beside {accepted[-1].candidate.name}" if accepted else "")
        )
        taken = {s.candidate.key for s in accepted}
        proposals = screen(bench, current, [c for c in candidates if c.key not in taken], scan(current))
        gains = largest_gains(current, proposals, seed + number)
        limit = threshold(gains)
        scored = _refine_best(bench, weights, current, current_held, proposals, limit, say)
        choice, objections = _choose(bench, weights, current, current_held, scored, limit, not accepted, say)
        factors = bench.factors("fit")
        named = {s.candidate.effect.name for s in accepted}
        rivals = () if choice is None else _rivals(bench, choice, scored, current, current_held, named)
        rounds.append(
            Round(limit, tuple(proposals), tuple(scored), choice, objections, rivals, gains, factors)
        )
        if choice is None:
            break
        accepted.append(choice)
        current, reweighed = weights.weigh(choice.fit)
        if reweighed is None:
            return None
        current_held = reweighed
    accepted, current, current_held, notes = _prune(bench, unknowns, weights, accepted, current, current_held)
    while accepted and (name := out_of_range(current)):
        notes.append(f"{accepted[-1].candidate.name} was dropped: it drives {name} to the end of its range")
        accepted = accepted[:-1]
        current = accepted[-1].fit if accepted else base
        fallen = bench.residuals(current.unknowns, current.vector[None, :], "validate")[0]
        if fallen is None:
            return None
        current_held = fallen
    return Attribution(
        base,
        base_cost,
        tuple(rounds),
        tuple(accepted),
        current,
        weights.plain(weights.base_held, "validate"),
        weights.plain(current_held, "validate"),
        tuple(notes),
    )


def _choose(
    bench: Bench,
    weights: ChannelWeights,
    current: Fit,
    held: FloatArray,
    scored: Sequence[Scored],
    limit: float,
    first: bool,
    say: Say,
) -> tuple[Scored | None, tuple[str, ...]]:
    """The effect to accept, fitted with all parameters, if any; why each that was tried was not, "" for it."""
    objections: list[str] = []
    doubtful: Scored | None = None
    for one in near_best(scored):
        why = objection(bench, weights, held, one, limit, first)
        if not why:
            say(f"fitting {one.candidate.name} with all parameters")
            one = polish(bench, one, current, held)
            why = insignificant(one)
            if not why and (name := out_of_range(one.fit)):
                why = f"{one.candidate.name}: it drives the declared parameter {name} to the end of its range"
                doubtful = doubtful or one  # another effect that is still missing may do that
        objections.append(why)
        if not why:
            return one, tuple(objections)
    return doubtful, tuple(objections)


def _refine_best(
    bench: Bench,
    weights: ChannelWeights,
    current: Fit,
    held: FloatArray,
    proposals: Sequence[Proposal],
    limit: float,
    say: Say,
) -> list[Scored]:
    """The best proposals of the best effects, fitted with the declared parameters, best on held-out data first."""
    chosen: list[Proposal] = []
    per_effect: dict[str, int] = {}
    worth = max(limit, WORTH * proposals[0].gain) if proposals else limit
    for proposal in proposals:
        name = proposal.candidate.effect.name
        if proposal.gain < worth or (name not in per_effect and len(per_effect) == REFINED):
            continue
        per_effect[name] = per_effect.get(name, 0) + 1
        if per_effect[name] <= 2:
            chosen.append(proposal)
    scored: list[Scored] = []
    solved = 0.0
    for proposal in chosen:
        if proposal.gain < RIVAL_WORTH * solved:
            continue
        say(f"fitting {proposal.label}")
        result = score(bench, current, held, proposal)
        if result is not None:
            scored.append(result)
            if weights.left(result.validate) < SMALLEST_STRUCTURE**2:
                solved = max(solved, result.fit_gain, proposal.gain)
    most = max((s.fit_gain for s in scored), default=0.0)
    scored = [go_on(bench, s, current, held) if s.fit_gain > RIVAL_WORTH * most else s for s in scored]
    return sorted(scored, key=lambda s: -s.held_out_gain)


def _prune(
    bench: Bench,
    unknowns: Unknowns,
    weights: ChannelWeights,
    accepted: list[Scored],
    current: Fit,
    held: FloatArray,
) -> tuple[list[Scored], Fit, FloatArray, list[str]]:
    """Drop every earlier effect that the later ones have made needless."""
    notes: list[str] = []
    while len(accepted) > 1:
        for dropped in accepted[:-1]:
            kept = [s for s in accepted if s is not dropped]
            fewer = extended_unknowns(unknowns, kept)
            vector = current.at(fewer.names)
            fit = refine(bench, fewer, vector, iterations=6, enough=3.0)
            validate = None if fit is None else bench.residuals(fewer, fit.vector[None, :], "validate")[0]
            if fit is None or validate is None:
                continue
            lost = block_gains(bench.of("validate"), validate, held)
            total = float(weights.base_held @ weights.base_held - held @ held)
            if consistency(lost) < SIGMAS or float(lost.sum()) < 0.01 * total:
                notes.append(
                    f"{dropped.candidate.name} was dropped: the effects found after it explain the same"
                )
                accepted, current, held = kept, fit, validate
                break
        else:
            break
    return accepted, current, held, notes


def _rivals(
    bench: Bench,
    winner: Scored,
    scored: Sequence[Scored],
    base: Fit,
    held: FloatArray,
    named: Collection[str],
) -> tuple[Scored, ...]:
    """Other effects than the accepted one and those ``named`` before that explain held-out recordings as well."""
    rivals: dict[str, Scored] = {}
    for other in scored:
        name = other.candidate.effect.name
        if name == winner.candidate.effect.name or name in rivals or name in named:
            continue
        if other.held_out_gain < 0.9 * winner.held_out_gain:
            continue
        polished = polish(bench, other, base, held)
        lead = block_gains(bench.of("validate"), polished.validate, winner.validate)
        if consistency(lead) < SIGMAS or float(lead.sum()) < TIE_SHARE * winner.held_out_gain:
            rivals[name] = polished
    return tuple(rivals.values())
