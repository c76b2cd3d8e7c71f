"""One round of the search: what to refine, which of it to accept, and what these recordings cannot tell from that."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from thsa_cosim.diagnosis.choosing.gates import (
    SIGMAS,
    SMALLEST_STRUCTURE,
    TOTAL_SHARE,
    Evidence,
    insignificant,
    near_best,
    objection,
    objection_beside,
    out_of_range,
    signal_share,
)
from thsa_cosim.diagnosis.choosing.places import shaft_scales
from thsa_cosim.diagnosis.choosing.score import Scored, go_on, leaves_little, polish, score
from thsa_cosim.diagnosis.choosing.screen import Proposal
from thsa_cosim.diagnosis.choosing.sizes import at_sizes, is_led_astray
from thsa_cosim.diagnosis.choosing.starts import PROMISING, further_starts
from thsa_cosim.diagnosis.choosing.verdict import VISIBLE, is_visible, leaves_structure
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.structure import block_gains, consistency, errors
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights
from thsa_cosim.signals import FloatArray

#: Rivals that leave less than this share of the gain unexplained cannot be told apart, ...
TIE_SHARE = 0.005
#: ... and those that reach less than this share of it are none.
RIVAL_SHARE = 0.9
#: A rival that leaves this share of the gain in one of the fit recordings can be told apart there.
APART_SHARE = 0.02
#: How many effects are refined after each screening, if they promise at least this share of the best one's gain, and
#: with how many starts each.
REFINED, WORTH, STARTS = 6, 0.03, 2
#: Two variants of an effect in one place that promise the same but for this share begin as one law: one start.
ALIKE = 1e-3
#: Once an effect leaves no structure, only those that promise this share of its gain are refined as rivals; and only
#: those that reach this share of the best gain in two iterations are refined further.
RIVAL_WORTH = 0.3
#: A small further effect that explains this share of what is left is fitted with all parameters before it is judged:
#: what the first one's parameters have taken up of it counts for it as well.
HALF = 0.5

#: Ripples at so many other wave numbers are refined where no fit leaves nothing, and so many other laws.
WAVES, LAWS = 6, 4
#: A further start is refined if it promises this much more than the candidate's starts before.
BETTER = 1.05

Say = Callable[[str], None]


def worth_refining(proposals: Sequence[Proposal], limit: float) -> list[Proposal]:
    """The best starts of the best effects among ``proposals`` (best first) that promise more than chance."""
    chosen: list[Proposal] = []
    per_effect: dict[str, int] = {}
    worth = max(limit, WORTH * proposals[0].gain) if proposals else limit
    for proposal in proposals:
        name = proposal.candidate.effect.name
        if proposal.gain < worth or (name not in per_effect and len(per_effect) == REFINED):
            continue
        begun = any(_begins_as(proposal, other) for other in chosen)
        per_effect[name] = per_effect.get(name, 0) + (not begun)
        if begun or per_effect[name] <= STARTS:
            chosen.append(proposal)
    return chosen


def _begins_as(proposal: Proposal, other: Proposal) -> bool:
    """Whether ``proposal`` is another variant of the law that ``other`` begins with, which promises no less."""
    one, two = proposal.candidate, other.candidate
    return one.name == two.name and one.key != two.key and proposal.gain >= (1.0 - ALIKE) * other.gain


def each_start_once(proposals: Sequence[Proposal]) -> list[Proposal]:
    """``proposals`` without those that another one begins at: a search around a point comes by that point again."""
    found: dict[tuple[str, tuple[str, ...]], Proposal] = {}
    for p in proposals:
        found.setdefault((p.candidate.key, tuple(f"{name} {x:.9g}" for name, x in p.shapes.items())), p)
    return list(found.values())


def other_places(winner: Proposal, proposals: Sequence[Proposal]) -> list[Proposal]:
    """The best proposal of the winner's effect in every other place that promises nearly as much."""
    found: dict[str, Proposal] = {}
    for proposal in proposals:
        candidate, name = proposal.candidate, proposal.candidate.name
        same = candidate.effect.name == winner.candidate.effect.name and name != winner.candidate.name
        if same and proposal.gain >= RIVAL_WORTH * winner.gain:
            found.setdefault(name, proposal)
    return list(found.values())


def geared(winner: Scored, other: Scored) -> Scored | None:
    """``other`` at the optimum of ``winner``, the same form of its effect on another shaft that turns at a ratio.

    Speeds and angles grow by the ratio, torques fall by it. None if the form has no speed or angle of its own (then the
    fit is nearly linear and finds its way), or one of the two is no shaft.
    """
    one, two = winner.candidate, other.candidate
    same = one.effect.name == two.effect.name and one.number == two.number and one.component == two.component
    if not same or one.slot.name == two.slot.name or not (one.slot.is_angular and two.slot.is_angular):
        return None
    dimensions = {p.name: p.dimension for p in two.variant.parameters}
    lengths = [p for p in one.shapes if dimensions[p.name] in ("V", "Z", "D")]
    theirs = {p.name: p for p in two.parameters}
    if not lengths:
        return None
    ratio = theirs[lengths[0].name].typical / lengths[0].typical
    shaft = shaft_scales(ratio)
    factors = {p.name: p.scale(shaft) for p in two.variant.parameters}
    values = dict(winner.fit.unknowns.named(winner.fit.vector))
    values |= {
        theirs[p.name].variable: values[p.variable] * factors[p.name]
        for p in one.parameters
        if p.variable in values
    }
    unknowns = other.fit.unknowns
    if any(name not in values for name in unknowns.names):
        return None
    vector = unknowns.clip(np.array([values[name] for name in unknowns.names]))
    return replace(other, fit=replace(other.fit, vector=vector))


def simplest_first(scored: Sequence[Scored], ties: Callable[[Scored, Scored], bool]) -> list[Scored]:
    """``scored``, best first, but before the best the simplest form of its effect there that explains as much.

    ``ties``: whether the first explains as much as the second, within the uncertainty.
    """
    ordered = list(scored)
    for other in sorted(scored[1:], key=lambda s: len(s.candidate.coefficients)):
        best, own = ordered[0].candidate, other.candidate
        same = (own.effect.name, own.slot.name, own.component) == (
            best.effect.name,
            best.slot.name,
            best.component,
        )
        if same and len(own.coefficients) < len(best.coefficients) and ties(other, ordered[0]):
            return [other, *(s for s in ordered if s is not other)]
    return ordered


def other_waves(proposals: Sequence[Proposal], scored: Sequence[Scored]) -> list[Proposal]:
    """The ripples among ``proposals`` (best first) at wave numbers that were not refined.

    Where a ripple makes a machine stick and slip, what a small one would do hardly tells one order from another.
    """
    refined = {id(s.proposal) for s in scored}
    best = proposals[0].gain if proposals else 0.0
    return [
        p
        for p in proposals
        if id(p) not in refined
        and p.gain >= PROMISING * best
        and any(q.scanned and not q.fixed for q in p.candidate.shapes)
    ][:WAVES]


def other_laws(proposals: Sequence[Proposal], scored: Sequence[Scored]) -> list[Proposal]:
    """The best start among ``proposals`` (best first) of every law that was left out of an effect that was refined.

    Of friction along the stroke, starts of a wave may have left none for a local rise.
    """
    known = {s.candidate.key for s in scored}
    effects = {s.candidate.effect.name for s in scored}
    best = proposals[0].gain if proposals else 0.0
    found: dict[str, Proposal] = {}
    for p in proposals:
        is_left_out = p.candidate.effect.name in effects and p.candidate.key not in known
        if is_left_out and p.gain >= PROMISING * best:
            found.setdefault(p.candidate.key, p)
    return list(found.values())[:LAWS]


@dataclass(frozen=True, eq=False)
class Selection:
    """A round against the model so far: its fit ``current`` and its held-out residuals ``held`` (N,).

    ``rough``: whether a candidate is gone on from in another way, so that a first fit of it will do. ``whole``: whether
    what is compared is fitted with all parameters.
    """

    bench: Bench
    weights: ChannelWeights
    current: Fit
    held: FloatArray
    say: Say = lambda _: None
    rough: Callable[[Scored], bool] = lambda _: False
    whole: bool = True
    _polished: dict[int, Scored] = field(default_factory=dict)

    def refined(self, proposals: Sequence[Proposal], limit: float) -> list[Scored]:
        """What is worth it, fitted with the declared parameters, best on held-out recordings first."""
        return self.fitted(worth_refining(proposals, limit))

    def fitted(self, proposals: Sequence[Proposal]) -> list[Scored]:
        """``proposals`` fitted with the declared parameters, best on held-out recordings first."""
        scored: list[Scored] = []
        solved = 0.0
        for proposal in proposals:
            if proposal.gain < RIVAL_WORTH * solved:
                continue
            self.say(f"fitting {proposal.label}")
            result = score(self.bench, self.current, self.held, proposal)
            if result is not None:
                scored.append(result)
                if self.weights.left(result.validate) < SMALLEST_STRUCTURE**2:
                    solved = max(solved, result.fit_gain, proposal.gain)
        most = max((s.fit_gain for s in scored), default=0.0)
        scored = [self._go_on(s) if s.fit_gain > RIVAL_WORTH * most else s for s in scored]
        return simplest_first(sorted(scored, key=lambda s: -s.held_out_gain), self._ties)

    def is_open(self, scored: Sequence[Scored]) -> bool:
        """Whether something is left to explain, and no fit so far leaves nothing."""
        fits = [self.held, *(s.validate for s in scored)]
        return all(self.weights.left(held) >= SMALLEST_STRUCTURE**2 for held in fits)

    def further(self, proposals: Sequence[Proposal]) -> list[Proposal]:
        """Further starts of the shapes of the best ``proposals``."""
        self.say("searching further starts of the effects' shapes")
        return further_starts(self.bench, self.current, proposals)

    def refined_further(
        self,
        scored: Sequence[Scored],
        proposals: Sequence[Proposal],
        further: Sequence[Proposal],
        limit: float,
    ) -> list[Scored]:
        """``scored`` and what is worth it of ``further`` starts, other laws and wave numbers, fitted; best first."""
        before: dict[str, float] = {}
        for p in proposals:
            before[p.candidate.key] = max(before.get(p.candidate.key, 0.0), p.gain)
        better = worth_refining([p for p in further if p.gain > BETTER * before[p.candidate.key]], limit)
        others = [*other_laws(proposals, scored), *other_waves(proposals, scored)]
        chosen = sorted(each_start_once([*better, *others]), key=lambda p: -p.gain)
        found = sorted([*scored, *self.fitted(chosen)], key=lambda s: -s.held_out_gain)
        return simplest_first(found, self._ties)

    def at_sizes(self, scored: Sequence[Scored], proposals: Sequence[Proposal]) -> list[Scored]:
        """``scored`` and, where they lead astray, effects of larger sizes than their responses promise; best first."""
        if not is_led_astray(self.current, scored):
            return list(scored)
        self.say("trying effects of larger sizes")
        found = [*scored, *at_sizes(self.bench, self.current, self.held, proposals)]
        return simplest_first(sorted(found, key=lambda s: -s.held_out_gain), self._ties)

    def evidence(self, one: Scored) -> Evidence:
        """What speaks for a candidate."""
        trials, base = self.bench.of("validate"), self.weights.base_held
        return Evidence(
            name=one.candidate.name,
            fit_gain=one.fit_gain,
            held_out_gain=one.held_out_gain,
            consistency=one.consistency,
            left=self.weights.left(self.held),
            share=one.share,
            signal_share=signal_share(trials, base, self.held, one.validate),
            visible=leaves_structure(self.bench, self.weights, one.validate),
            was_visible=leaves_structure(self.bench, self.weights, self.held),
        )

    def choose(
        self, scored: Sequence[Scored], limit: float, first: bool, beside: bool = False
    ) -> tuple[Scored | None, tuple[str, ...]]:
        """The effect to accept, fitted with all parameters, if any; why each that was tried was not, "" for it.

        ``first``: no effect is in the model yet. ``beside``: they are further parts of one that is.
        """
        objections: list[str] = []
        doubtful: Scored | None = None
        for one in near_best(scored):
            evidence = self.evidence(one)
            small = evidence.signal_share < TOTAL_SHARE and evidence.share >= HALF
            whole = small and not first and not beside
            if whole:
                one = self._whole(one)
                evidence = self.evidence(one)
            why = objection_beside(evidence, limit) if beside else objection(evidence, limit, first)
            if not why:
                one = one if whole else self._whole(one)
                why = insignificant(one)
                if not why and (name := out_of_range(one.fit)):
                    why = f"{one.candidate.name}: it drives the declared parameter {name} to the end of its range"
                    # Another effect that is still missing may do that: with all parameters fitted the best one counts.
                    if doubtful is None or one.held_out_gain > doubtful.held_out_gain:
                        doubtful = one
            objections.append(why)
            if not why:
                return one, tuple(objections)
        return doubtful, tuple(objections)

    def elsewhere(
        self, winner: Scored, scored: Sequence[Scored], proposals: Sequence[Proposal]
    ) -> list[Scored]:
        """The winner's effect in the places that were not refined, fitted: behind a rigid gear they are one law."""
        found = []
        for proposal in other_places(winner.proposal, proposals):
            if not any(s.candidate.name == proposal.candidate.name for s in scored):
                self.say(f"fitting {proposal.label}")
                result = score(self.bench, self.current, self.held, proposal)
                found += [] if result is None else [self._go_on(result)]
        return found

    def rivals(self, winner: Scored, scored: Sequence[Scored], named: Collection[str]) -> tuple[Scored, ...]:
        """What explains the held-out recordings as well: other effects than those ``named`` before, other places."""
        effect, own = winner.candidate.effect.name, winner.candidate.name
        rivals: dict[str, Scored] = {}
        for other in scored:
            candidate = other.candidate
            name = candidate.name if candidate.effect.name == effect else candidate.effect.name
            if name in (own, *rivals, *named):
                continue
            if other.held_out_gain < RIVAL_SHARE * winner.held_out_gain:
                start = geared(winner, other)
                if start is None:
                    continue
                other = start
            polished = self.polished(other)
            if self._ties(polished, winner) and not self.is_better(winner, polished):
                rivals[name] = polished
        return tuple(rivals.values())

    def overtaking(self, winner: Scored, scored: Sequence[Scored]) -> Scored | None:
        """What explains the held-out recordings as well as the winner and fits one of the others clearly better."""
        found = [
            self.polished(other)
            for other in scored
            if other.candidate.name != winner.candidate.name
            and other.held_out_gain >= RIVAL_SHARE * winner.held_out_gain
        ]
        better = [s for s in found if self._ties(s, winner) and self.is_better(s, winner)]
        believed = [s for s in better if not insignificant(s) and not out_of_range(s.fit)]
        return min(believed, key=lambda s: s.fit.cost, default=None)

    def is_better(self, one: Scored, other: Scored) -> bool:
        """Whether of two that explain the held-out recordings alike the first is the one to believe.

        It fits a recording better; or both fit alike and leave little but noise, and only the other one needs a machine
        far off its drawing.
        """
        if self.fits_better(one, other):
            return True
        off = other.fit.unknowns.is_far(other.fit.vector) and not one.fit.unknowns.is_far(one.fit.vector)
        if not off or not all(leaves_little(self.bench, s.fit) for s in (one, other)):
            return False
        return one.fit.cost + SIGMAS**2 < other.fit.cost and not self.fits_better(other, one)

    def fits_better(self, one: Scored, other: Scored) -> bool:
        """Whether there is a fit recording in which the second leaves what the first explains, beyond chance."""
        trials = self.bench.of("fit")
        begin = 0
        for trial in trials:
            part = slice(begin, begin := begin + sum(c.measured.size for c in trial.case.channels))
            base, ours, theirs = (f.residual[part] for f in (self.current, one.fit, other.fit))
            lead = block_gains((trial,), theirs, ours)
            sure = consistency(lead) >= SIGMAS and float(lead.sum()) >= SIGMAS**2
            large = float(lead.sum()) >= APART_SHARE * float(base @ base - ours @ ours)
            if sure and (large or self._only_theirs_shows(trial, part, ours, theirs)):
                return True
        return False

    def _only_theirs_shows(self, trial: Trial, part: slice, ours: FloatArray, theirs: FloatArray) -> bool:
        """Whether a recording shows nothing of what one fit leaves there, but of what the other does.

        Then what it leaves is the other's misfit, however little beside the gain: the first has none to excuse it.
        """
        factors = self.bench.factors("fit")[part]
        left = (errors((trial,), residual / factors) for residual in (ours, theirs))
        one, other = (is_visible(found, VISIBLE) for found in left)
        return other and not one

    def polished(self, one: Scored) -> Scored:
        """A candidate fitted with all parameters, once."""
        key = id(one.proposal)
        if key not in self._polished:
            polished = (
                polish(self.bench, one, self.current, self.held, self.rough(one)) if self.whole else None
            )
            self._polished[key] = polished or self._go_on(one)
        return self._polished[key]

    def _whole(self, one: Scored) -> Scored:
        if self.whole:
            self.say(f"fitting {one.candidate.name} with all parameters")
        return self.polished(one)

    def _go_on(self, one: Scored) -> Scored:
        return go_on(self.bench, one, self.current, self.held)

    def _ties(self, other: Scored, winner: Scored) -> bool:
        lead = block_gains(self.bench.of("validate"), other.validate, winner.validate)
        return consistency(lead) < SIGMAS or float(lead.sum()) < TIE_SHARE * winner.held_out_gain
