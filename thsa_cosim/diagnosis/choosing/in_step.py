"""A machine that a ripple makes stick and slip: its effects are found with the model kept in step, then freed.

The order of the ripple comes from the force that keeps the model in step (`observer`); its size and phase, and what
else is missing, from fits in step. From there they are continued to the free run, which judges.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.attribution import Attribution, Begun, Scan, attribute
from thsa_cosim.diagnosis.choosing.chance import largest_gains, threshold
from thsa_cosim.diagnosis.choosing.gates import SIGMAS, insignificant, out_of_range
from thsa_cosim.diagnosis.choosing.observer import order_in_step
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.choosing.ripples import on_orders
from thsa_cosim.diagnosis.choosing.rounds import Round
from thsa_cosim.diagnosis.choosing.score import Scored, extended_unknowns, judge, refit, score
from thsa_cosim.diagnosis.choosing.screen import Proposal, propose
from thsa_cosim.diagnosis.choosing.selection import Say
from thsa_cosim.diagnosis.choosing.verdict import leaves_structure
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.continuation import released
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.following import Followed, Following
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns, unknowns_of
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights
from thsa_cosim.signals import FloatArray

#: The model is kept in step where an order makes up this share of the force's power. Of 23 simulated units, 9 of them
#: with cogging, it was 0.2 to 0.75 with, and less than 0.1 without: set while looking at them.
SHARE = 0.18
#: Two orders that are less apart are the same one. A simulated resolver's eccentricity showed order 2 and then 107; a
#: cogging stayed within 1 in all of 19 simulated units. Set while looking at them.
NEAR = 1.5
#: The order is looked for with so much of the gain: a looser model shows less of the noise of what it follows. Of two
#: simulated units with cogging the share rose from 0.13 to 0.22 and from 0.41 to 0.54, of four others it stayed below
#: 0.08. Set while looking at them.
LOOSER = 0.3
#: The free run finds a ripple by itself if it leaves less structure than this, in variances of the noise: 0.001 to 0.06
#: where it did, 0.17 to 230 where it ended beside the optimum or more is missing. Set while looking at 20 simulated
#: units with cogging.
FREE = 0.1
#: What is followed, by means of samples, leaves a structure of its own: in step, less than the noise is not looked at.
SETTLED = 1.0
#: An effect beside the ripple has to promise this share of what is left: the true ones of three simulated units
#: promised 0.17 to 0.37, what imitates the error of what is followed at most 0.066. Set while looking at them.
LEAST = 0.1
#: Where the free run is lost without it, the best one may promise less: a true one promised 0.084 in a simulated unit,
#: a false one 0.006 in another. Set while looking at them.
FURTHER = 0.03
#: Relative tolerance of the free run from there on: at a search's 1e-4 the solver's errors move the events that a fit
#: has to hit. Three simulated units ended beside the optimum there, at 1.4, 2.5 and 1.2 times the noise on held-out
#: recordings, and at 1.04, 1.6 and 1.5 at this one. Set while looking at them.
TOLERANCE = 1e-5
_KEPT = (
    "effects were looked for with the model kept in step with a measured speed, since a ripple may make the machine"
    " stick and slip; "
)
#: What is said where the model was kept in step, ...
NOTE = _KEPT + "they were fitted to the free run from there"
#: ... and where the free run with what was found in step falls out of step.
LOST = _KEPT + "the free run with them falls out of step with the machine, so they were judged in step"


def _beside(fit: Fit, proposal: Proposal) -> Fit:
    """``fit`` with the parameters of a further part, which is neutral so far."""
    own = unknowns_of(proposal.candidate, proposal.shapes, proposal.held)
    unknowns = fit.unknowns.with_members([u for u in own if u.name not in fit.unknowns.names])
    further = unknowns.members[len(fit.unknowns.members) :]
    scale = np.array([u.scale for u in further])
    return replace(
        fit,
        unknowns=unknowns,
        vector=np.concatenate([fit.vector, [u.start for u in further]]),
        own=np.concatenate([fit.jacobian, proposal.response * scale], axis=1),
        shared=None,
        steps=np.concatenate([fit.steps, np.full(len(further), 1e-2)]),
    )


def _round(bench: Bench, fit: Fit, proposals: Sequence[Proposal], one: Scored, seed: int) -> Round:
    """A round of the one effect that was asked for beside ``fit``."""
    gains = largest_gains(fit, proposals, seed)
    return Round(threshold(gains), tuple(proposals), (one,), one, ("",), (), gains, bench.factors("fit"))


def _is_ripple(candidate: Candidate) -> bool:
    """Whether it repeats with the position."""
    return any(p.scanned for p in candidate.shapes)


@dataclass(frozen=True, eq=False)
class InStep:
    """How to find effects in step, of ``unknowns`` and ``candidates`` on ``bench``."""

    bench: Bench
    following: Following
    unknowns: Unknowns
    candidates: Sequence[Candidate]
    scan: Scan
    machine: Machine
    seed: int
    say: Say

    def found(self, weights: ChannelWeights, base: Fit, held: FloatArray) -> Begun | None:
        """What is found in step, if a ripple shows there and the free run then leaves less than ``held``.

        The ripple as the free run finds it is tried in the first round, where that is enough, or the other way fails.
        """
        if not leaves_structure(self.bench, weights, held):
            return None
        followed = self.following.followed(self.unknowns, base.vector)
        if followed is None or not followed.slot.is_angular:
            return None
        gain = self.following.gain(self.unknowns, base.vector)
        if gain is None:
            return None
        order, share = self._order(followed, gain, base)
        if share < SHARE:
            return None
        freely = self._added(self.bench, followed, (order,), base, held)
        one = None if freely is None else freely.accepted
        # In the first round it stands beside what the screening finds, whose starts may have led elsewhere.
        otherwise = Begun((), (), base, held, tried=() if one is None else (one,))
        if one is not None and weights.left(one.validate) < FREE:
            return otherwise
        self.say(f"keeping the model in step with {followed.channel}, which lacks {order:g} waves per turn")
        stepped = self.following.at(gain)
        stepped.weights = {}
        found = attribute(
            stepped,
            self.unknowns,
            self.candidates,
            self.scan,
            seed=self.seed,
            machine=self.machine,
            deep=False,
            begin=lambda w, b, h: self._ripple(stepped, followed, gain, order, w, b, h),
            settled=SETTLED,
            least=LEAST,
            say=self.say,
        )
        if found is None:
            return otherwise
        left = min(weights.left(h) for h in (held, *(s.validate for s in otherwise.tried)))
        whole = self._whole(stepped, followed, gain, found, order)
        if not any(_is_ripple(s.candidate) for s in whole.accepted):
            return otherwise  # nothing repeats with the position once all else is in the model
        begun = self._freed(stepped, gain, weights, whole, left)
        if begun is None and (more := self._further(stepped, found, whole)) is not None:
            begun = self._freed(stepped, gain, weights, more, left)
        if begun is None:
            begun = self._judged_in_step(whole)
        return otherwise if begun is None else begun

    def _judged_in_step(self, whole: Begun) -> Begun | None:
        """``whole`` as it runs freely, out of step; None if it holds nothing but ripples, or does not run.

        A free run that is lost knows nothing of what else is missing: an effect that passed the gates in step does.
        """
        if all(_is_ripple(s.candidate) for s in whole.accepted):
            return None
        unknowns, vector = whole.fit.unknowns, whole.fit.vector
        fit = refine(self.bench, unknowns, vector, steps=whole.fit.steps, iterations=1)
        if fit is None:
            return None
        (held,) = self.bench.residuals(unknowns, fit.vector[None, :], "validate")
        if held is None:
            return None
        return Begun(whole.rounds, whole.accepted, fit, held, notes=(LOST,), in_step=True)

    def _freed(
        self, stepped: Bench, gain: float, weights: ChannelWeights, whole: Begun, left: float
    ) -> Begun | None:
        """What was found in step, as the free run judges it; None if that leaves no less than ``left``."""
        self.say("letting the model run freely")
        before = self.bench.weights
        weights.take(stepped.weights)
        fine = self.following.finer(TOLERANCE)
        fit = released(fine, self.following, gain, whole.fit)
        if fit is not None:
            accepted, fit = self._needed(fine, whole.accepted, fit)
            own = ChannelWeights(fine)
            fit, held = own.weigh(fit)
            if held is not None and not out_of_range(fit) and own.left(held) < left:
                self.bench.go_over(fine)
                weights.take(fine.weights)
                # A free run that falls out of step now and then says little of what else there may be.
                return Begun(whole.rounds, accepted, fit, held, notes=(NOTE,))
        weights.take(before)
        return None

    def _further(self, stepped: Bench, found: Attribution, whole: Begun) -> Begun | None:
        """``whole`` with what promised most, but too little, in the last screening in step; None: no such effect."""
        last = found.rounds[-1]
        least = max(threshold(last.gains), FURTHER * found.final.misfit)
        known = {s.candidate.name for s in whole.accepted}
        best = next((p for p in last.proposals if not p.candidate.variant.beside), None)
        if last.accepted is not None or best is None or best.gain < least or best.candidate.name in known:
            return None
        proposals = propose(stepped, whole.fit, [(best.candidate, best.shapes)])
        if not proposals:
            return None
        proposal = replace(proposals[0], held=best.held)
        self.say(f"fitting {proposal.label} in step")
        one = score(stepped, whole.fit, whole.held, proposal)
        if one is None:
            return None
        # In front: what is found after it may make it needless.
        return Begun(
            (_round(stepped, whole.fit, [proposal], one, self.seed), *whole.rounds),
            (one, *whole.accepted),
            one.fit,
            one.validate,
        )

    def _order(self, followed: Followed, gain: float, fit: Fit) -> tuple[float, float]:
        """Periods per revolution of what ``fit`` lacks at the followed place, and their share of the force's power."""
        looser = LOOSER * gain
        return order_in_step(self.following.at(looser), followed, looser, fit)

    def _needed(self, bench: Bench, accepted: tuple[Scored, ...], fit: Fit) -> tuple[tuple[Scored, ...], Fit]:
        """``accepted`` less further parts of an effect that the free run does not tell from nothing, and its fit."""
        for one in (s for s in accepted if s.candidate.variant.beside):
            if insignificant(replace(one, fit=fit)):
                kept = tuple(s for s in accepted if s is not one)
                fewer = extended_unknowns(self.unknowns, kept)
                again = refine(bench, fewer, fit.at(fewer.names), jacobian=fit.jacobian_of(fewer), near=True)
                if again is not None:
                    accepted, fit = kept, again
        return accepted, fit

    def _ripple(
        self,
        stepped: Bench,
        followed: Followed,
        gain: float,
        before: float,
        weights: ChannelWeights,
        base: Fit,
        held: FloatArray,
    ) -> Begun | None:
        """The ripple at the followed place whose order the force shows, if nothing outweighs it.

        ``before``: the order that it showed before the declared parameters were fitted in step, which may take it up.
        """
        order, _share = self._order(followed, gain, base)
        made = self._added(stepped, followed, (order, before), base, held)
        if made is None or (one := made.accepted) is None:
            return None
        if min(one.fit_gain, one.held_out_gain) < made.threshold or one.consistency < SIGMAS:
            return None
        fit, own = weights.weigh(one.fit)
        return None if own is None else Begun((made,), (one,), fit, own)

    def _whole(
        self, stepped: Bench, followed: Followed, gain: float, found: Attribution, before: float
    ) -> Begun:
        """What was found, the ripple if that was outweighed and still shows, and its second harmonic, neutral.

        Both hardly gain in step: the force tells of the ripple, the free run whether the harmonic is needed. Where
        nothing was found, the force has to show the order that it showed ``before``: an error of the speed's sensor
        leaves it another one once the declared parameters are fitted.
        """
        rounds, accepted, fit = found.rounds, found.accepted, found.final
        held = found.final_validate * stepped.factors("validate")
        order, share = self._order(followed, gain, fit)
        # Without a ripple so far, what showed its order may have been another effect that is in the model now.
        still = share >= SHARE and (bool(accepted) or abs(order - before) < NEAR)
        shows = still or any(_is_ripple(s.candidate) for s in accepted)
        for harmonic in (False, True) if shows else ():
            made = self._added(stepped, followed, (order,), fit, held, harmonic)
            if made is not None and (one := made.accepted) is not None:
                rounds, accepted, fit, held = (*rounds, made), (*accepted, one), one.fit, one.validate
        return Begun(rounds, accepted, fit, held)

    def _added(
        self,
        stepped: Bench,
        followed: Followed,
        orders: Sequence[float],
        fit: Fit,
        held: FloatArray,
        harmonic: bool = False,
    ) -> Round | None:
        """A ripple of the followed place beside ``fit``, or the ``harmonic`` of the one that it has, as a round.

        Of several ``orders`` the one that promises most.
        """
        known = fit.unknowns.named(fit.vector)
        rows = []
        for candidate in (c for c in self.candidates if c.slot.name == followed.slot.name):
            waves = [p for p in candidate.shapes if p.scanned]
            is_new = not any(p.variable in known for p in candidate.coefficients)
            is_harmonic = candidate.variant.beside and all(p.variable in known for p in waves)
            plain = not candidate.variant.beside and not candidate.variant.instead
            if waves and is_new and (is_harmonic if harmonic else plain):
                rows += [
                    (candidate, {p.name: known.get(p.variable, order) for p in waves})
                    for order in dict.fromkeys(orders)
                ]
        proposals = on_orders(propose(stepped, fit, rows), self.machine, fit)
        if not proposals:
            return None
        best = proposals[0]
        self.say(f"fitting {best.label} {'to the free run' if stepped is self.bench else 'in step'}")
        if harmonic:
            one = judge(stepped, best, _beside(fit, best), fit, held)
        else:
            one = score(stepped, fit, held, best)
            one = one and refit(stepped, best, fit, held, one.fit.unknowns, one.fit.vector, one.fit.steps)
        if one is None:
            return None
        return _round(stepped, fit, proposals, one, self.seed)
