"""The gates that an effect has to pass: held-out gain, consistency, share, significance, plausible parameters."""

from collections.abc import Sequence

import numpy as np

from thsa_cosim.diagnosis.choosing.score import Scored
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.structure import structures
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights
from thsa_cosim.signals import FloatArray

#: An effect must be this many standard errors from nothing, and its held-out gain from chance.
SIGMAS = 3.0
#: The share of the structure left that a first and a further effect must explain on the held-out recordings.
FIRST_SHARE, NEXT_SHARE = 0.15, 0.2
#: A further effect must explain this share of what the declared model left in some channel, or it may be the misfit of
#: the first one.
TOTAL_SHARE = 0.1
#: Structure below this many standard deviations of the noise (rms over all channels) is not worth an effect.
SMALLEST_STRUCTURE = 0.08
#: If the best candidate is not believed, others are tried that gain this share of what it does, at most so many.
NEAR, MOST_TRIED = 0.5, 4


def near_best(scored: Sequence[Scored]) -> list[Scored]:
    """Those that come near the best one: if that cannot be believed, one of them may take its place."""
    near = [s for s in scored[1:] if s.held_out_gain >= NEAR * scored[0].held_out_gain]
    return [*scored[:1], *near][:MOST_TRIED]


def objection(
    bench: Bench, weights: ChannelWeights, held: FloatArray, one: Scored, limit: float, first: bool
) -> str:
    """Why the held-out recordings do not ask for an effect, or ""."""
    wanted = FIRST_SHARE if first else NEXT_SHARE
    name = one.candidate.name
    if one.fit_gain < limit or one.held_out_gain < limit:
        return f"{name} gains no more than chance on the held-out recordings"
    if one.consistency < SIGMAS:
        return f"{name}: its held-out gain is within {SIGMAS:g} standard errors of chance"
    if weights.left(held) < SMALLEST_STRUCTURE**2:
        return "what is left is too small against the noise to be worth an effect"
    if one.share < wanted:
        return f"{name} explains {100 * one.share:.0f} % of what is left, less than {100 * wanted:.0f} %"
    if _explained(bench.of("validate"), weights.base_held, held, one.validate) < TOTAL_SHARE:
        return f"{name} explains less than {100 * TOTAL_SHARE:.0f} % of what the declared model left in any signal"
    return ""


def _explained(trials: Sequence[Trial], base: FloatArray, before: FloatArray, after: FloatArray) -> float:
    """Largest share over the channels of what the declared model left (``base``) that a step explains."""
    whole, first, last = (structures(trials, residual) for residual in (base, before, after))
    return max((first[name] - last[name]) / max(whole[name], SMALLEST_STRUCTURE**2) for name in whole)


def insignificant(choice: Scored) -> str:
    """Why a fit cannot be told from a model without the effect, or ""."""
    fit = choice.fit
    inflation = max(1.0, fit.misfit / fit.residual.size)
    stderr = fit.stderr(inflation)
    coefficients = choice.candidate.coefficients
    own = fit.unknowns.index([p.variable for p in coefficients])
    moved = np.abs(fit.vector[own] - [p.neutral for p in coefficients])
    if np.all(moved < SIGMAS * stderr[own]):
        return f"{choice.candidate.name}: the interval of its coefficient includes zero"
    return ""


def out_of_range(fit: Fit) -> str:
    """Name of a declared parameter that a fit drives to the end of its range, or ""."""
    for u, x in zip(fit.unknowns.members, fit.vector, strict=True):
        if u.declared and (x <= u.lower or x >= u.upper):
            return u.name
    return ""
