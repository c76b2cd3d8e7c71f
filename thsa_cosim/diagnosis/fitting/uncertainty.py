"""How sure a fit is where its residuals are correlated in time, as what a model still lacks makes them.

The sandwich A⁻¹ (B + P) A⁻¹ (Huber, 1967; White, 1980) with A = JᵀJ + P: B is the long-run covariance of the scores
(Newey and West, Econometrica 55, 1987), as in an identification (`search.uncertainty`), and P what the drawing says,
which no residual makes less sure. Where white noise of the residuals' size would say less, that counts.
"""

from collections.abc import Sequence

import numpy as np

from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.search import andrews_bandwidth, long_run_covariance
from thsa_cosim.signals import FloatArray

#: The kernel reaches at least this far: small structure beneath white noise decides over a long time and shows in no
#: correlation of neighbours. As long as the blocks of the held-out gains [s].
REACH = 0.5


def standard_errors(fit: Fit, trials: Sequence[Trial]) -> FloatArray:
    """(n,) standard errors in the unknowns' units; infinite where nothing determines an unknown.

    ``trials``: the recordings that ``fit.residual`` (N,) stacks.
    """
    prior = np.diag((fit.unknowns.precision * fit.unknowns.scale) ** 2)
    inverse = fit.covariance()
    open_ = ~np.isfinite(np.diag(inverse))
    inverse = np.where(np.isfinite(inverse), inverse, 0.0)
    long_run, white = np.zeros_like(inverse), np.zeros_like(inverse)
    for score, squares, lags in _scores(fit, trials):
        long_run += long_run_covariance(score, max(lags, andrews_bandwidth(score)))
        white += squares
    variances = [np.diag(inverse @ (middle + prior) @ inverse) for middle in (long_run, white)]
    found = np.sqrt(np.maximum(*variances)) * fit.unknowns.scale
    return np.where(open_, np.inf, found)


def _scores(fit: Fit, trials: Sequence[Trial]) -> list[tuple[FloatArray, FloatArray, int]]:
    """Per recording (per channel, where they are sampled apart) the scores (m, n), what white noise of the same size
    would make of their products (n, n), and the lags within `REACH`."""
    found: list[tuple[FloatArray, FloatArray, int]] = []
    begin, whole = 0, fit.jacobian
    for trial in trials:
        own = []
        for channel in trial.case.channels:
            part = slice(begin, begin := begin + channel.measured.size)
            residual, jacobian = fit.residual[part], whole[part]
            lags = round(REACH * (part.stop - part.start) / max(float(np.ptp(channel.time)), 1e-12))
            own.append((residual[:, None] * jacobian, np.mean(residual**2) * (jacobian.T @ jacobian), lags))
        if len({len(score) for score, *_ in own}) == 1:  # sampled together: noise may be common to them
            scores, squares, lags_ = zip(*own, strict=True)
            own = [(np.sum(scores, axis=0), np.sum(squares, axis=0), max(lags_))]
        found += own
    return found
