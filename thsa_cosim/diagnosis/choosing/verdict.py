"""The verdict: whether an effect is missing, nothing is, something that no effect explains, or nothing was tried."""

from collections.abc import Mapping, Sequence

from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.structure import errors, worst_share
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights
from thsa_cosim.diagnosis.results import StructuredError, Verdict
from thsa_cosim.signals import FloatArray

#: Structure (rms in standard deviations of the noise, in some signal) and its significance that count as visible in a
#: model without effects, ...
VISIBLE, SIGNIFICANT = 0.15, 6.0
#: ... and in one with effects, whose form and contact with the solver's steps are never quite those of the machine:
#: an error of 1.1 times the noise.
VISIBLE_BESIDE = 0.46
#: Without an effect, a held-out error of so many times the noise is no noise, however few samples make it.
GROSS = 3.0


def verdict_on(errors_after: Mapping[str, StructuredError], accepted: int, tested: int) -> Verdict:
    """The verdict on held-out ``errors_after`` with ``accepted`` effects out of ``tested`` candidates.

    In standard deviations, not in shares: a hundredth of a large residual may still be a fault that anybody sees.
    """
    gross = not accepted and any(e.rmse > GROSS * e.noise for e in errors_after.values())
    if gross or is_visible(errors_after, VISIBLE_BESIDE if accepted else VISIBLE):
        return "unexplained-structure" if tested else "not-tested"
    if accepted:
        return "missing-effect"
    return "no-missing-effect" if tested else "not-tested"


def note_on_standard_errors(errors_after: Mapping[str, StructuredError], accepted: int) -> str:
    """A doubt about the standard errors of a model that leaves held-out ``errors_after``; "" where nothing is left.

    They hold what noise makes of the values, and correlated residuals, but not what the model lacks.
    """
    if verdict_on(errors_after, accepted, tested=1) != "unexplained-structure":
        return ""
    ratio, channel = max((e.rmse / e.noise, name) for name, e in errors_after.items())
    return (
        f"the model leaves {ratio:.3g} times the noise in {channel} on held-out recordings: the standard errors are"
        " those of a model that lacks nothing, and values may be off by more"
    )


def is_visible(found: Mapping[str, StructuredError], size: float) -> bool:
    """Whether some signal holds structure that is neither chance nor smaller than ``size`` (in its noise)."""
    return any(e.structure > size * e.noise and e.significance > SIGNIFICANT for e in found.values())


def leaves_structure(
    bench: Bench, weights: ChannelWeights, held: FloatArray, size: float = VISIBLE_BESIDE
) -> bool:
    """Whether the held-out residuals (N,) hold structure of ``size``, by default as the verdict counts it."""
    return is_visible(errors(bench.of("validate"), weights.plain(held, "validate")), size)


def left_over(trials: Sequence[Trial], before: FloatArray, after: FloatArray) -> float:
    """Share (0 to 1) of the declared model's held-out structure that is left in the signal where most is.

    ``before``, ``after``: (N,) residuals in standard deviations. Signals without visible structure before and after
    are left out.
    """
    first, last = errors(trials, before), errors(trials, after)
    shown = [n for n in first if is_visible({n: first[n]}, VISIBLE) or is_visible({n: last[n]}, VISIBLE)]
    return worst_share(trials, before, after, shown)
