"""What the noise of measured inputs adds to the errors of a fit.

A measured load drives the model: smoothed to a few straight lines it still errs at every knot, and all samples of a
recording share that error, which no residual shows. A parametric bootstrap (B. Efron, R. Tibshirani, An Introduction to
the Bootstrap, 1993, 6.5): the input is smoothed again from further draws of its noise, and the model simulated with it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from thsa_cosim.diagnosis.fitting.bench import AT_ONCE
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.recordings.spline import LinearSpline
from thsa_cosim.signals import FloatArray

#: So many draws know a standard error to a quarter; of long recordings as many as memory should hold, at least these.
DRAWS, LEAST = 8, 4
#: A change of slope by this share of the largest slope is a knot.
BEND = 1e-6


def knots(time: FloatArray, values: FloatArray) -> FloatArray:
    """(k,) times of the ends and the bends of a piecewise-linear signal (n,); of bends at neighbours the first."""
    slopes = np.diff(values) / np.diff(time)
    bends = 1 + np.flatnonzero(np.abs(np.diff(slopes)) > BEND * max(float(np.abs(slopes).max()), 1e-300))
    alone = np.diff(bends, prepend=-2) > 1
    inner = bends[alone]
    return np.asarray(time[[0, *inner[inner < time.size - 1], time.size - 1]])


def drawn(trial: Trial, number: int) -> Trial:
    """The same recording with its smoothed inputs as another draw of their noise would have left them."""
    case = trial.case
    random = np.random.default_rng([number, sum(case.name.encode())])
    time = case.inputs.time
    step = float(time[-1] - time[0]) / (time.size - 1)
    values = dict(case.inputs.values)
    for name, noise in case.input_noise.items():
        at = knots(time, values[name])
        spline = LinearSpline(
            (time - time[0]) / step, random.normal(0.0, noise, time.size), (at - time[0]) / step
        )
        values[name] = values[name] + np.interp(time, at, spline.levels)
    inputs = replace(case.inputs, values=values)
    return replace(trial, case=replace(case, name=f"{case.name}, draw {number}", inputs=inputs))


def draws_of(trials: Sequence[Trial]) -> list[tuple[Trial, ...]]:
    """Draws of the fit recordings among ``trials``; none where no input was smoothed."""
    fitted = [t for t in trials if t.part == "fit"]
    if not any(t.case.input_noise for t in fitted):
        return []
    size = sum(8 * t.case.inputs.time.size * len(t.case.inputs.values) for t in fitted)
    count = max(LEAST, min(DRAWS, AT_ONCE // size))
    return [tuple(drawn(t, number) for t in fitted) for number in range(1, count + 1)]


def errors_of_inputs(fit: Fit, residuals: Sequence[FloatArray]) -> FloatArray:
    """(n,) standard errors in the unknowns' units, from the residuals (N,) of every draw at the fitted vector.

    Each draw moves the optimum by a Gauss-Newton step; 0 for what nothing determines. What few draws do not know of
    their own spread counts: two such errors are the 95 % of Student's law.
    """
    inverse = fit.covariance()
    inverse = np.where(np.isfinite(inverse), inverse, 0.0)
    moves = [inverse @ (fit.jacobian.T @ (residual - fit.residual)) for residual in residuals]
    if not moves:
        return np.zeros(fit.vector.size)
    few = float(student.ppf(0.975, len(moves)) / norm.ppf(0.975))
    return np.asarray(few * np.sqrt(np.mean(np.square(moves), axis=0)) * fit.unknowns.scale)
