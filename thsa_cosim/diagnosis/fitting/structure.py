"""What is left in a residual beside white noise, and how sure that is.

The product of neighbouring samples has the mean 0 for white noise whatever its size, and that of the squared structure
for anything that is smooth over a sample: unlike the root mean square it does not need the noise to be known.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import rankdata

from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.results import ChannelError
from thsa_cosim.signals import FloatArray

#: Structure (rms, in standard deviations of the noise) below which a share of it says little.
HARDLY = 0.5


def split(trials: Sequence[Trial], residual: FloatArray) -> dict[str, list[FloatArray]]:
    """Stacked residuals (N,) → per channel one array per recording, in standard deviations."""
    parts: dict[str, list[FloatArray]] = {}
    for own in per_trial(trials, residual):
        for name, part in own.items():
            parts.setdefault(name, []).append(part)
    return parts


def per_trial(trials: Sequence[Trial], residual: FloatArray) -> list[dict[str, FloatArray]]:
    """Stacked residuals (N,) → per recording its channels' residuals by name, in standard deviations."""
    found: list[dict[str, FloatArray]] = []
    position = 0
    for trial in trials:
        found.append({})
        for channel in trial.case.channels:
            found[-1][channel.name] = residual[position : position + channel.measured.size]
            position += channel.measured.size
    return found


def lagged(parts: Sequence[FloatArray]) -> tuple[float, float]:
    """Mean product of neighbours and its standard deviation for white noise of the same size."""
    products = np.concatenate([part[1:] * part[:-1] for part in parts])
    power = float(np.mean(np.concatenate(parts) ** 2))
    return float(products.mean()), min(power, 1.5) / np.sqrt(products.size)


def structures(trials: Sequence[Trial], residual: FloatArray) -> dict[str, float]:
    """Per channel the mean square of the structure, in variances of the noise; may be negative."""
    return {name: lagged(parts)[0] for name, parts in split(trials, residual).items()}


def structure(trials: Sequence[Trial], residual: FloatArray) -> float:
    """Sum over channels and samples of the squared structure, in variances of the noise; may be negative."""
    return float(
        sum(lagged(parts)[0] * sum(p.size for p in parts) for parts in split(trials, residual).values())
    )


def worst_share(trials: Sequence[Trial], before: FloatArray, after: FloatArray) -> float:
    """Largest share of a channel's structure ``before`` (N,) that is left ``after`` (N,), 0 to 1.

    Channel by channel, or position, which sums up every error of speed, would hide all others; where there was hardly
    any structure before, as a share of ``HARDLY`` squared.
    """
    first, last = structures(trials, before), structures(trials, after)
    return float(np.clip(max(last[name] / max(first[name], HARDLY**2) for name in first), 0.0, 1.0))


def errors(trials: Sequence[Trial], residual: FloatArray) -> Mapping[str, ChannelError]:
    """Per channel the error over the recordings."""
    noises = {c.name: [] for t in trials for c in t.case.channels}  # type: dict[str, list[float]]
    for trial in trials:
        for channel in trial.case.channels:
            noises[channel.name].append(channel.noise / np.sqrt(channel.weight))
    found = {}
    for name, parts in split(trials, residual).items():
        noise = float(np.sqrt(np.mean(np.square(noises[name]))))
        mean, deviation = lagged(parts)
        joined = np.concatenate(parts)
        found[name] = ChannelError(
            rmse=float(np.sqrt(np.mean(joined**2))) * noise,
            noise=noise,
            structure=float(np.sqrt(max(mean, 0.0))) * noise,
            significance=mean / deviation,
            samples=joined.size,
        )
    return found


def block_gains(
    trials: Sequence[Trial], worse: FloatArray, better: FloatArray, seconds: float = 0.5
) -> FloatArray:
    """Decrease of the squared residuals per block of time (b,), all channels together.

    Blocks are long against the correlation of the residuals, so that their scatter says what chance does.
    """
    sums: list[FloatArray] = []
    for trial, gain in zip(trials, per_trial(trials, worse**2 - better**2), strict=True):
        blocks = [
            np.bincount(np.floor((c.time - c.time[0]) / seconds).astype(int), weights=gain[c.name])
            for c in trial.case.channels
        ]
        longest = max(b.size for b in blocks)
        sums.append(np.sum([np.pad(b, (0, longest - b.size)) for b in blocks], axis=0))
    return np.concatenate(sums)


def consistency(gains: FloatArray) -> float:
    """How many standard errors block gains (b,) lie above chance: the larger of Student's t and Wilcoxon's z.

    t sees a gain in the few blocks where an effect acts; the signed ranks (F. Wilcoxon, Biometrics Bulletin 1 (1945)
    80) see one that a few blocks outweigh, as where another effect has not been found yet.
    """
    if gains.size < 2:
        return 0.0
    t = float(gains.mean() / max(gains.std(ddof=1) / np.sqrt(gains.size), 1e-12))
    ranks = rankdata(np.abs(gains))
    z = float(np.sum(ranks * np.sign(gains)) / max(np.sqrt(np.sum(ranks**2)), 1e-12))
    return max(t, z)
