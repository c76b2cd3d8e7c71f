"""A fit in step with the measured speed, continued to the free run.

In step, the least squares are smooth and Gauss-Newton finds its way from the drawing, but the force that keeps the
model in step hides a part of what is missing, and the noise of what is followed biases what is found. So the gain falls
to zero, each fit from the one before (a continuation), and the free run judges.
"""

import numpy as np

from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.following import Following

#: The gains of a continuation, as shares of the one that keeps the model in step. These and the iterations at each were
#: set while looking at two simulated units with cogging that sticks.
SHARES, ITERATIONS = (0.3, 0.1, 0.03, 0.01), 3
#: A fit on the way ends where a step brings less than this share of the squares: it only has to lead to the next one.
SETTLED = 0.003
#: It is given up where the misfit grows to so many times the least on the way: the model falls out of step. So it is
#: where the first gain leaves so many times the misfit in step, whose force hid what is missing: 2.5 in a simulated
#: unit whose effect in step was the wrong one, 0.87 to 1.34 in nine others; in eight more that led to the free run it
#: never grew, in one that did not it grew to 1.7 times. Set while looking at them.
LOST = 1.5
#: Where it grows to so many times the least, a gain between the two is put in, at most so often. Set while looking at
#: one simulated unit with a strong cogging of two harmonics.
GROWN, MORE = 1.1, 6
#: A gain that was put in has helped if the misfit after it has lost so much of its growth. In one simulated unit where
#: such gains led to the free run it lost all of it, in another 0.12 and less: set while looking at them.
HELPED = 0.5


def released(bench: Bench, following: Following, gain: float, fit: Fit) -> Fit | None:
    """A ``fit`` in step by ``gain``, continued to the free run on ``bench``; None if it falls out of step there.

    The way may be too steep for the ladder of gains: as long as it helps, one between the last two is gone to first.
    """
    least, last, ahead, more = np.inf, 1.0, [*SHARES, 0.0], MORE
    lost, before = LOST * fit.misfit, dict[float, float]()
    while ahead:
        share = ahead[0]
        again = refine(
            following.at(share * gain) if share else bench,
            fit.unknowns,
            fit.vector,
            jacobian=fit.jacobian,
            steps=fit.steps,
            near=True,
            iterations=ITERATIONS if share else 8,
            enough=SETTLED * fit.residual.size if share else 1.0,
        )
        misfit = np.inf if again is None else again.misfit
        is_worse = again is None or misfit > GROWN * least
        may_help = share not in before or misfit <= least + (1.0 - HELPED) * (before[share] - least)
        if more and is_worse and may_help:
            more -= 1
            before[share] = misfit
            ahead.insert(0, float(np.sqrt(last * share)) if share else 0.3 * last)
            continue
        if again is None or misfit > lost:
            return None
        fit, least, last = again, min(least, misfit), share
        lost = LOST * least
        del ahead[0]
    return fit
