"""The verdict: whether an effect is missing, nothing is, or something that the catalogue does not know."""

from collections.abc import Mapping, Sequence

from thsa_cosim.diagnosis.fitting.structure import errors, worst_share
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.results import ChannelError, Verdict
from thsa_cosim.signals import FloatArray

#: More than this share of some channel's structure left after all effects: something else is missing.
UNEXPLAINED_SHARE = 0.25
#: Structure (rms in standard deviations of the noise, in some channel) and its significance that count as such.
VISIBLE, SIGNIFICANT = 0.15, 6.0


def verdict_on(
    held_out: Sequence[Trial], before: FloatArray, after: FloatArray, accepted: bool
) -> tuple[float, Verdict]:
    """Share of the held-out structure that is left in the worst channel, and the verdict.

    ``before``, ``after``: (N,) held-out residuals of the declared and of the extended model, in standard deviations.
    """
    visible = is_visible(errors(held_out, after))
    share = worst_share(held_out, before, after) if visible else 0.0
    if accepted and not (visible and share > UNEXPLAINED_SHARE):
        return share, "missing-effect"
    return share, "unexplained-structure" if visible else "no-missing-effect"


def is_visible(found: Mapping[str, ChannelError]) -> bool:
    """Whether some channel holds structure that is neither chance nor too small to matter."""
    return any(e.structure > VISIBLE * e.noise and e.significance > SIGNIFICANT for e in found.values())
