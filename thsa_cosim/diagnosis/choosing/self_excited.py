"""A friction that falls with the speed and excites the machine itself: fitted in step, then freed.

The place sticks and slips some hundred times a second, and every cycle takes up the phase of the one before: a free run
that is off by a thousandth in its frequency is out of phase within a second, and least squares are lost outside a basin
as narrow. In step with the measured speed (`Following`) every cycle begins where the machine was. What is found there
is continued to the free run, which judges; where the two differ, the parameters are known no better.
"""

from dataclasses import dataclass, replace

import numpy as np

from thsa_cosim.diagnosis.choosing.attribution import Judged
from thsa_cosim.diagnosis.choosing.curves import falls
from thsa_cosim.diagnosis.choosing.gates import insignificant, out_of_range
from thsa_cosim.diagnosis.choosing.score import ENOUGH, Scored
from thsa_cosim.diagnosis.choosing.selection import Say
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.continuation import released
from thsa_cosim.diagnosis.fitting.fit import Fit, cost_of, refine
from thsa_cosim.diagnosis.fitting.following import Following
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights

#: Gains of the fits in step, as shares of the one that leaves least: more of it is smoother, but follows more noise.
SHARES = (3.0, 1.0, 0.3)
#: The first of them has to take this share of the squares away. It was set, with the gains and the iterations, while
#: looking at two simulated units with a Stribeck friction that sticks and slips.
PROMISE, ITERATIONS = 0.03, 5


@dataclass(frozen=True, eq=False)
class SelfExcited:
    """How to fit such a friction on ``bench``."""

    bench: Bench
    following: Following
    say: Say

    def continued(self, weights: ChannelWeights, found: Judged) -> tuple[Judged, tuple[Scored, ...]] | None:
        """A better fit from the ones in step, and these; None where there is none.

        ``found``: the accepted effect, the model's fit with it and its held-out residuals.
        """
        choice, fit, _held = found
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
        stepped = self._in_step(following, gain, fit)
        if not stepped:
            return None
        self.say(f"letting the model with {choice.candidate.name} run freely")
        free = released(self.bench, following, SHARES[-1] * gain, stepped[-1])
        if free is None or free.cost >= fit.cost or out_of_range(free):
            return None
        better = replace(choice, proposal=replace(choice.proposal), fit=free)
        if insignificant(better):
            return None
        again, own = weights.weigh(free)
        if own is None:
            return None
        better = replace(better, fit=again, validate=own)
        return (better, again, own), tuple(replace(better, fit=one) for one in stepped)

    def _in_step(self, following: Following, gain: float, fit: Fit) -> list[Fit]:
        """``fit`` in step, by falling gains, each from the one before; none where the first promises too little."""
        found: list[Fit] = []
        for share in SHARES:
            bench = following.beside_signal(share * gain)
            (residual,) = bench.residuals(fit.unknowns, fit.vector[None, :], "fit")
            if residual is None:
                return []
            before = cost_of(fit.unknowns, fit.vector, residual)
            again = refine(
                bench,
                fit.unknowns,
                fit.vector,
                residual=residual,
                jacobian=fit.jacobian if found else None,
                steps=fit.steps,
                near=bool(found),
                iterations=ITERATIONS,
                enough=3.0,
            )
            if again is None or (not found and again.cost > (1.0 - PROMISE) * before):
                return []
            found.append(again)
            fit = again
        return found
