"""How large a gain chance makes, by a parametric bootstrap of the fitted model.

White noise of the sensors' size is drawn over and over; each time the declared parameters are fitted (to first order)
and every proposal is offered, as in the search. The largest gain of each draw is what a model
that lacks nothing would show (Efron and Tibshirani, An Introduction to the Bootstrap, chapter 6).
"""

from collections.abc import Sequence

import numpy as np

from thsa_cosim.diagnosis.fit import Fit
from thsa_cosim.diagnosis.screen import Orthogonal, Proposal
from thsa_cosim.signals import FloatArray

DRAWS = 200
_EULER = 0.5772156649


def largest_gains(base: Fit, proposals: Sequence[Proposal], seed: int, draws: int = DRAWS) -> FloatArray:
    """(draws,) the largest gain that any of the proposals has on noise alone."""
    if not proposals:
        return np.zeros(draws)
    generator = np.random.default_rng(seed)
    orthogonal = Orthogonal(base)
    left = [orthogonal.remaining(p.response) for p in proposals]
    noise = generator.standard_normal((base.residual.size, draws), dtype=np.float32)
    best = np.zeros(draws)
    for proposal, columns in zip(proposals, left, strict=True):
        pull = np.asarray(columns.T @ noise, dtype=float)
        scale = np.sqrt(np.maximum(np.diag(proposal.precision), 1e-300))
        correlation = proposal.precision / np.outer(scale, scale)
        whitened = np.linalg.lstsq(correlation, pull / scale[:, None], rcond=1e-6)[0]
        best = np.maximum(best, np.sum((pull / scale[:, None]) * whitened, axis=0))
    return best


def threshold(gains: FloatArray, chance: float = 1e-3) -> float:
    """Gain that chance exceeds with probability ``chance``: Gumbel's law through the draws' mean and deviation."""
    spread = float(np.std(gains, ddof=1)) * np.sqrt(6.0) / np.pi
    return float(np.mean(gains) - _EULER * spread - spread * np.log(-np.log1p(-chance)))


def probability(gain: float, gains: FloatArray) -> float:
    """Probability that chance makes at least ``gain``."""
    spread = max(float(np.std(gains, ddof=1)) * np.sqrt(6.0) / np.pi, 1e-9)
    location = float(np.mean(gains)) - _EULER * spread
    return float(-np.expm1(-np.exp(-min((gain - location) / spread, 700.0))))
