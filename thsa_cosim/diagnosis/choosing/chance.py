"""How large a gain chance makes, by a parametric bootstrap of the fitted model.

White noise of the sensors' size is drawn over and over; each time the declared parameters are fitted (to first order)
and every proposal is offered, as in the search. The largest gain of each draw is what a model
that lacks nothing would show (Efron and Tibshirani, An Introduction to the Bootstrap, chapter 6).
"""

from collections.abc import Sequence

import numpy as np

from thsa_cosim.diagnosis.choosing.screen import Orthogonal, Proposal
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.signals import FloatArray

DRAWS = 1000
_EULER = 0.5772156649


def largest_gains(base: Fit, proposals: Sequence[Proposal], seed: int, draws: int = DRAWS) -> FloatArray:
    """(draws,) the largest gain that any of the proposals has on noise alone; what does nothing gains nothing."""
    proposals = [p for p in proposals if p.is_testable]
    if not proposals:
        return np.zeros(draws)
    orthogonal = Orthogonal(base)
    products = orthogonal.products([p.response for p in proposals])
    size = np.sqrt(np.maximum(np.diag(products), 1e-300))
    # White noise pulls at the responses with their Gram matrix as covariance, so the noise itself need not be drawn.
    correlation = products / np.outer(size, size)
    values, vectors = np.linalg.eigh(correlation)
    normal = np.random.default_rng(seed).standard_normal((values.size, draws))
    pull = vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * normal)
    best, position = np.zeros(draws), 0
    for proposal in proposals:
        own = slice(position, position := position + proposal.response.shape[1])
        whitened = np.linalg.lstsq(correlation[own, own], pull[own], rcond=1e-6)[0]
        best = np.maximum(best, np.sum(pull[own] * whitened, axis=0))
    return best


def threshold(gains: FloatArray, chance: float = 1e-3) -> float:
    """Gain that chance exceeds with probability ``chance``."""
    location, spread = _gumbel(gains)
    return float(location - spread * np.log(-np.log1p(-chance)))


def probability(gain: float, gains: FloatArray) -> float:
    """Probability that chance makes at least ``gain``."""
    location, spread = _gumbel(gains)
    return float(-np.expm1(-np.exp(-np.clip((gain - location) / max(spread, 1e-9), -700.0, 700.0))))


def _gumbel(gains: FloatArray) -> tuple[float, float]:
    """Location and spread of Gumbel's law with the mean and the deviation of ``gains``."""
    spread = float(np.std(gains, ddof=1)) * float(np.sqrt(6.0)) / float(np.pi)
    return float(np.mean(gains)) - _EULER * spread, spread
