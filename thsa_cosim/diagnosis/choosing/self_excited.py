"""A friction that falls with the speed and excites the machine itself: fitted in step, then freed.

The place sticks and slips some hundred times a second, and every cycle takes up the phase of the one before: a free run
that is off by a thousandth in its frequency is out of phase within a second, and least squares are lost outside a basin
as narrow. In step with the measured speed (`Following`) every cycle begins where the machine was. What is found there
is continued to the free run, which judges; where the two differ, the parameters are known no better.

The free run that is out of phase does not tell one form of the curve from another either: they are compared in step.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.attribution import Judged
from thsa_cosim.diagnosis.choosing.curves import falls, nearest
from thsa_cosim.diagnosis.choosing.forms import is_form
from thsa_cosim.diagnosis.choosing.gates import insignificant, out_of_range
from thsa_cosim.diagnosis.choosing.score import ENOUGH, Scored
from thsa_cosim.diagnosis.choosing.selection import Say
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.continuation import released
from thsa_cosim.diagnosis.fitting.fit import Fit, cost_of, refine
from thsa_cosim.diagnosis.fitting.following import Following
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns, unknowns_of
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights
from thsa_cosim.signals import FloatArray

#: Gains of the fits in step, as shares of the one that leaves least: more of it is smoother, but follows more noise.
SHARES = (3.0, 1.0, 0.3)
#: The first of them has to take this share of the squares away. It was set, with the gains and the iterations, while
#: looking at two simulated units with a Stribeck friction that sticks and slips.
PROMISE, ITERATIONS = 0.03, 5
#: Gains that are put in on the way to the free run. At the nut they led nowhere: two simulated units with a Stribeck
#: friction left 2.04 and 3.97 times the noise with them, 2.05 and 4.28 without; set while looking at them.
MORE = 0


@dataclass(frozen=True, eq=False)
class SelfExcited:
    """How to fit such a friction on ``bench``, in the form among ``candidates`` that fits best."""

    bench: Bench
    following: Following
    candidates: Sequence[Candidate]
    say: Say

    def continued(self, weights: ChannelWeights, found: Judged) -> tuple[Judged, tuple[Scored, ...]] | None:
        """The fit that the ones in step lead to, or that of ``found`` where its free run is the better one, and these.

        ``found``: the accepted effect, the model's fit with it and its held-out residuals. None where nothing in step
        promises enough.
        """
        choice, fit, held = found
        values = {**choice.fit.unknowns.named(choice.fit.vector), **fit.unknowns.named(fit.vector)}
        left = weights.plain(fit.residual, "fit")
        if float(np.mean(left**2)) < ENOUGH or not falls(choice.candidate, values):
            return None
        following = self.following.of(choice.candidate.slot)
        gain = following.gain(fit.unknowns, fit.vector)
        followed = following.followed(fit.unknowns, fit.vector)
        if gain is None or followed is None:
            return None
        self.say(f"fitting {choice.candidate.name} in step with {followed.channel}")
        stepped = self._in_step(following, gain, choice, fit)
        if not stepped:
            return None
        best = stepped[-1]
        self.say(f"letting the model with {best.candidate.name} run freely")
        # Under the weights that the fits in step have, too: costs are compared.
        same = replace(choice, proposal=replace(choice.proposal), fit=fit, validate=held), fit, held
        free = released(self.bench, following, SHARES[-1] * gain, best.fit, MORE)
        if free is None or free.cost >= fit.cost or out_of_range(free):
            return same, stepped
        better = replace(best, proposal=replace(best.proposal), fit=free)
        if insignificant(better):
            return same, stepped
        again, own = weights.weigh(free)
        if own is None:
            return same, stepped
        return (replace(better, fit=again, validate=own), again, own), stepped

    def _in_step(self, following: Following, gain: float, choice: Scored, fit: Fit) -> tuple[Scored, ...]:
        """The best form of ``choice``, fitted in step by falling gains, each from the one before.

        Nothing where the first of them promises too little.
        """
        tried: list[Scored] = []
        first = following.beside_signal(SHARES[0] * gain)
        before = np.inf
        for one, unknowns, vector, steps in self._starts(choice, fit):
            (residual,) = first.residuals(unknowns, vector[None, :], "fit")
            if residual is None:
                continue
            if one is choice:
                before = cost_of(unknowns, vector, residual)
            again = refine(
                first, unknowns, vector, residual=residual, steps=steps, iterations=ITERATIONS, enough=3.0
            )
            tried += [] if again is None else [replace(one, fit=again)]
        best = min(tried, key=lambda s: s.fit.cost + 2.0 * len(s.fit.vector), default=None)
        if best is None or best.fit.cost > (1.0 - PROMISE) * before:
            return ()
        found = [best]
        for share in SHARES[1:]:
            last = found[-1].fit
            again = refine(
                following.beside_signal(share * gain),
                last.unknowns,
                last.vector,
                jacobian=last.jacobian,
                steps=last.steps,
                near=True,
                iterations=ITERATIONS,
                enough=3.0,
            )
            if again is None:
                return ()
            found.append(replace(best, fit=again))
        return tuple(found)

    def _starts(self, choice: Scored, fit: Fit) -> Iterator[tuple[Scored, Unknowns, FloatArray, FloatArray]]:
        """``choice`` and its other forms, with the unknowns of the whole model, where they start, and steps (n,)."""
        yield choice, fit.unknowns, fit.vector, fit.steps
        values = {**choice.fit.unknowns.named(choice.fit.vector), **fit.unknowns.named(fit.vector)}
        own = {p.variable for p in choice.candidate.parameters}
        shared = {p.name for p in choice.candidate.parameters}
        for other in (c for c in self.candidates if is_form(c, choice.candidate)):
            held = {p.name: p.starts[0] for p in other.shapes if p.name not in shared}
            curve = nearest(other, held, choice.candidate, values)
            if curve is not None and len(other.coefficients) == len(choice.candidate.coefficients):
                shapes = {p.name: curve[p.variable] for p in other.shapes}
                kept = Unknowns(tuple(u for u in fit.unknowns.members if u.name not in own))
                unknowns = kept.with_members(added := unknowns_of(other, shapes))
                vector = unknowns.clip(np.array([{**values, **curve}[name] for name in unknowns.names]))
                # Two forms of a curve do nearly the same: what the one promised, the other does.
                proposal = replace(choice.proposal, candidate=other, shapes=shapes, held=frozenset())
                steps = np.concatenate([fit.steps_of(kept), np.full(len(added), 1e-2)])
                yield replace(choice, proposal=proposal), unknowns, vector, steps
