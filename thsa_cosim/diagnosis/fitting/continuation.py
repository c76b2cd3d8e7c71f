"""Fits of a machine that sticks and slips: in step with the measured speed first, then freer and freer.

In step, the least squares are smooth and Gauss-Newton finds its way from the drawing, but the force that keeps the
model in step hides a part of what is missing, and the noise of what is followed biases what is found. So the gain falls
to zero, each fit from the one before (a continuation), and the free run judges.
"""

from dataclasses import dataclass

import numpy as np

from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, promise, refine
from thsa_cosim.diagnosis.fitting.following import Following
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.signals import FloatArray

#: The gains of a continuation, as shares of the least one that keeps the model in step.
SHARES = (0.3, 0.1, 0.03, 0.01)
#: A fit is stuck where the linear model at its end promises this share of its cost, which no step gained.
STUCK = 0.005


def is_stuck(fit: Fit) -> bool:
    """Whether a fit ended although its linear model promises much: the run falls out of step at other events."""
    return promise(fit) > STUCK * fit.cost


@dataclass(frozen=True, eq=False)
class InStep:
    """Fits that follow the measured speed with ``gain`` at the start, and not at all in the end."""

    bench: Bench
    following: Following
    gain: float

    @property
    def held(self) -> Bench:
        """The bench of the model that is kept in step."""
        return self.following.at(self.gain)

    def fit(self, unknowns: Unknowns, start: FloatArray, to_beat: float = np.inf) -> Fit | None:
        """``unknowns`` fitted from ``start`` (n,); None if a run fails or the misfit ``to_beat`` is out of reach."""
        fit = refine(self.held, unknowns, start, iterations=12, enough=3.0)
        return None if fit is None or fit.misfit > to_beat else self.freed(fit)

    def freed(self, fit: Fit) -> Fit | None:
        """A fit in step, continued to the free run; None if a run fails."""
        for share in SHARES:
            again = refine(
                self.following.at(share * self.gain),
                fit.unknowns,
                fit.vector,
                jacobian=fit.jacobian,
                steps=fit.steps,
                near=True,
                iterations=3,
                enough=3.0,
            )
            if again is None:
                return None
            fit = again
        return refine(self.bench, fit.unknowns, fit.vector, jacobian=fit.jacobian, steps=fit.steps, near=True)
