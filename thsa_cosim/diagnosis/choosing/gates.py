"""The gates that an effect has to pass: held-out gain, consistency, share, existence, plausible parameters.

They read numbers only (`Evidence`), so that each can be tried without a simulation.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2, norm

from thsa_cosim.diagnosis.choosing.score import Scored
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.structure import structures
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.signals import FloatArray

#: An effect must be this many standard errors from nothing, and its held-out gain from chance.
SIGMAS = 3.0
#: The share of the structure left that a first and a further effect must explain on the held-out recordings.
FIRST_SHARE, NEXT_SHARE = 0.15, 0.2
#: A further effect must explain this share of what the declared model left in some channel, or it may be the misfit of
#: the first one; or else nearly all that is left, so that what was visible is no more: a misfit has not its form.
TOTAL_SHARE, NEARLY_ALL = 0.1, 0.9
#: Structure below this many standard deviations of the noise (rms over all channels) is not worth an effect.
SMALLEST_STRUCTURE = 0.08
#: If the best candidate is not believed, others are tried that gain this share of what it does, at most so many.
NEAR, MOST_TRIED = 0.5, 4


@dataclass(frozen=True)
class Evidence:
    """What speaks for a candidate that was fitted: gains in variances of the noise, ``consistency`` in standard errors.

    ``left``: mean squared structure of the held-out residuals without it, in variances of the noise. ``share``: how
    much of that it explains; ``signal_share``: of what the declared model left in the signal that gains most.
    ``visible``, ``was_visible``: whether a model with it, and one without it, leaves structure that is to be seen in
    some signal.
    """

    name: str
    fit_gain: float
    held_out_gain: float
    consistency: float
    left: float
    share: float
    signal_share: float
    visible: bool = True
    was_visible: bool = True


def objection(evidence: Evidence, limit: float, first: bool) -> str:
    """Why the held-out recordings do not ask for an effect whose gain chance keeps below ``limit``, or ""."""
    name, wanted = evidence.name, FIRST_SHARE if first else NEXT_SHARE
    if evidence.fit_gain < limit or evidence.held_out_gain < limit:
        return f"{name} gains no more than chance on the held-out recordings"
    if evidence.consistency < SIGMAS:
        return f"{name}: its held-out gain is within {SIGMAS:g} standard errors of chance"
    if evidence.left < SMALLEST_STRUCTURE**2:
        return "what is left is too small against the noise to be worth an effect"
    if evidence.share < wanted:
        return f"{name} explains {100 * evidence.share:.0f} % of what is left, less than {100 * wanted:.0f} %"
    explains_all = evidence.share >= NEARLY_ALL and evidence.was_visible and not evidence.visible
    if evidence.signal_share < TOTAL_SHARE and not explains_all:
        return f"{name} explains less than {100 * TOTAL_SHARE:.0f} % of what the declared model left in any signal"
    return ""


def objection_beside(evidence: Evidence, limit: float) -> str:
    """Why the held-out recordings do not ask for a further part of an effect that is in the model, or ""."""
    return objection(
        replace(evidence, share=1.0, signal_share=1.0), limit, True
    )  # the effect has passed these


def signal_share(trials: Sequence[Trial], base: FloatArray, before: FloatArray, after: FloatArray) -> float:
    """Largest share over the signals of what the declared model left (``base``) that a step explains."""
    whole, first, last = (structures(trials, residual) for residual in (base, before, after))
    return max((first[name] - last[name]) / max(whole[name], SMALLEST_STRUCTURE**2) for name in whole)


def near_best(scored: Sequence[Scored]) -> list[Scored]:
    """Those that come near the best one: if that cannot be believed, one of them may take its place."""
    near = [s for s in scored[1:] if s.held_out_gain >= NEAR * scored[0].held_out_gain]
    return [*scored[:1], *near][:MOST_TRIED]


def insignificant(choice: Scored) -> str:
    """Why a fit cannot be distinguished from a model without the effect, or "".

    Wald's test of all its coefficients together: one of them may well be zero. What the recordings say is widened by
    what they leave unexplained; what the drawing says is not.
    """
    fit, coefficients = choice.fit, choice.candidate.coefficients
    own = fit.unknowns.index([p.variable for p in coefficients])
    neutral = np.array([p.neutral for p in coefficients])
    covariance = fit.covariance(fit.inflation)[np.ix_(own, own)]
    known = np.isfinite(np.diag(covariance))
    moved = ((fit.vector[own] - neutral) / fit.unknowns.scale[own])[known]
    size = np.sqrt(np.diag(covariance)[known])
    alike = covariance[np.ix_(known, known)] / np.outer(size, size)
    distance = moved / size
    statistic = float(distance @ np.linalg.pinv(alike, hermitian=True) @ distance)
    if not known.any() or statistic < chi2.isf(2.0 * norm.sf(SIGMAS), np.count_nonzero(known)):
        return f"{choice.candidate.name}: its coefficients cannot be distinguished from zero"
    return ""


def out_of_range(fit: Fit) -> str:
    """Name of a declared parameter that a fit drives to the end of its range, or "".

    A quantity that cannot be negative, and whose size the drawing does not know, may be nothing: an effect that takes
    the place of the constant friction which stood for it leaves none of that.
    """
    for u, x in zip(fit.unknowns.members, fit.vector, strict=True):
        may_be_nothing = x <= u.lower == 0.0 and abs(u.start) <= u.spread < np.inf
        if u.declared and (x <= u.lower or x >= u.upper) and not may_be_nothing:
            return u.name
    return ""
