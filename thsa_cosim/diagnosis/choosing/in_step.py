"""A machine that a ripple makes stick and slip: its effects are found with the model kept in step, then freed.

The order of the ripple comes from the force that keeps the model in step (`observer`), its size and phase, and what is
missing beside it, from fits in step; from there they are continued to the free run, which judges.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.attribution import Begun, Round, Scan, attribute
from thsa_cosim.diagnosis.choosing.chance import largest_gains, threshold
from thsa_cosim.diagnosis.choosing.gates import insignificant, out_of_range
from thsa_cosim.diagnosis.choosing.observer import order_in_step
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.choosing.ripples import leaves_structure, on_orders
from thsa_cosim.diagnosis.choosing.score import Scored, extended_unknowns, judge, refit, score
from thsa_cosim.diagnosis.choosing.screen import Proposal, propose
from thsa_cosim.diagnosis.choosing.selection import Say
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
#: What is followed, by means of samples, leaves a structure of its own: in step, less than the noise is not looked at.
SETTLED = 1.0
#: What is said where the model was kept in step.
NOTE = (
    "effects were looked for with the model kept in step with a measured speed, since a ripple may make the machine"
    " stick and slip; they were fitted to the free run from there"
)


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


@dataclass(frozen=True, eq=False)
class InStep:
    """How to begin an attribution of ``unknowns`` and ``candidates`` on ``bench`` in step."""

    bench: Bench
    following: Following
    unknowns: Unknowns
    candidates: Sequence[Candidate]
    scan: Scan
    machine: Machine
    seed: int
    say: Say

    def begin(self, weights: ChannelWeights, base: Fit, held: FloatArray) -> Begun | None:
        """What is found in step, if a ripple shows there and the free run then leaves less than ``held``."""
        if not leaves_structure(self.bench, weights, held):
            return None
        followed = self.following.followed(self.unknowns, base.vector)
        gain = self.following.gain(self.unknowns, base.vector)
        if gain is None or followed is None or not followed.slot.is_angular:
            return None
        stepped = self.following.at(gain)
        order, share = order_in_step(stepped, followed, gain, base)
        if share < SHARE:
            return None
        self.say(f"keeping the model in step with {followed.channel}, which lacks {order:g} waves per turn")
        stepped.weights = {}
        found = attribute(
            stepped,
            self.unknowns,
            self.candidates,
            self.scan,
            seed=self.seed,
            machine=self.machine,
            deep=False,
            begin=lambda w, b, h: self._ripples(stepped, followed, gain, w, b, h),
            settled=SETTLED,
            say=self.say,
        )
        if found is None or not found.accepted:
            return None
        self.say("letting the model run freely")
        before, left = self.bench.weights, weights.left(held)
        weights.take(stepped.weights)
        fit = released(self.bench, self.following, gain, found.final)
        if fit is not None:
            accepted, fit = self._needed(found.accepted, fit)
            fit, own = weights.weigh(fit)
            if own is not None and not out_of_range(fit) and weights.left(own) < left:
                # A free run that falls out of step now and then says little of what else there may be.
                return Begun(found.rounds, accepted, fit, own, goes_on=False, notes=(NOTE,))
        weights.take(before)
        return None

    def _needed(self, accepted: tuple[Scored, ...], fit: Fit) -> tuple[tuple[Scored, ...], Fit]:
        """``accepted`` less further parts of an effect that the free run does not tell from nothing, and its fit."""
        for one in (s for s in accepted if s.candidate.variant.beside):
            if insignificant(replace(one, fit=fit)):
                kept = tuple(s for s in accepted if s is not one)
                fewer = extended_unknowns(self.unknowns, kept)
                again = refine(
                    self.bench, fewer, fit.at(fewer.names), jacobian=fit.jacobian_of(fewer), near=True
                )
                if again is not None:
                    accepted, fit = kept, again
        return accepted, fit

    def _ripples(
        self,
        stepped: Bench,
        followed: Followed,
        gain: float,
        weights: ChannelWeights,
        base: Fit,
        held: FloatArray,
    ) -> Begun | None:
        """The ripple at the followed place whose order the force shows, with its second harmonic."""
        order, _share = order_in_step(stepped, followed, gain, base)
        begun: Begun | None = None
        current = base
        for harmonic in (False, True):
            proposals = self._proposals(stepped, followed, order, current)
            if not proposals:
                break
            self.say(f"fitting {proposals[0].label} in step")
            if harmonic:  # of which hardly anything is to be seen in step: the free run tells
                one = judge(stepped, proposals[0], _beside(current, proposals[0]), current, held)
            else:  # what else is missing may outweigh it so far: the force has told
                one = score(stepped, current, held, proposals[0])
                one = (
                    None
                    if one is None
                    else refit(stepped, proposals[0], current, held, one.fit.unknowns, one.fit.vector)
                )
            if one is None:
                break
            gains, factors = largest_gains(current, proposals, self.seed), stepped.factors("fit")
            made = Round(threshold(gains), tuple(proposals), (one,), one, ("",), (), gains, factors)
            current, own = weights.weigh(one.fit)
            if own is None:
                break
            held = own
            before = ((), ()) if begun is None else (begun.rounds, begun.accepted)
            begun = Begun((*before[0], made), (*before[1], one), current, held)
        return begun

    def _proposals(self, stepped: Bench, followed: Followed, order: float, current: Fit) -> list[Proposal]:
        """The ripples of the followed place at an order, best first; their harmonics once they are in the model."""
        known = current.unknowns.named(current.vector)
        rows = []
        for candidate in (c for c in self.candidates if c.slot.name == followed.slot.name):
            waves = [p for p in candidate.shapes if p.scanned]
            fitted = any(p.variable in known for p in candidate.coefficients)
            harmonic = all(p.variable in known for p in waves)
            if (
                waves
                and not fitted
                and harmonic == candidate.variant.beside
                and not candidate.variant.instead
            ):
                rows.append((candidate, {p.name: known.get(p.variable, order) for p in waves}))
        return on_orders(propose(stepped, current, rows), self.machine, current)
