"""What is left in a residual beside white noise, and how sure that is.

The product of neighbouring samples has the mean 0 for white noise whatever its size, and that of the squared structure
for anything that is smooth over a sample: unlike the root mean square it does not need the noise to be known.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import norm, rankdata
from scipy.stats import t as student

from thsa_cosim.costs import signal_range
from thsa_cosim.costs.channels import Channel
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.results import StructuredError
from thsa_cosim.signals import FloatArray

#: The scatter over fewer blocks of time than this says little.
FEWEST = 12


def split(trials: Sequence[Trial], residual: FloatArray) -> dict[str, list[FloatArray]]:
    """Stacked residuals (N,) → per channel one array per recording, in standard deviations."""
    parts: dict[str, list[FloatArray]] = {}
    for own in per_trial(trials, residual):
        for name, part in own.items():
            parts.setdefault(name, []).append(part)
    return parts


def rms_by_channel(trials: Sequence[Trial], residual: FloatArray) -> dict[str, float]:
    """Root mean square of the stacked ``residual`` (N,) over all recordings, by channel."""
    return {
        name: float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
        for name, parts in split(trials, residual).items()
    }


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


def worst_share(
    trials: Sequence[Trial], before: FloatArray, after: FloatArray, names: Sequence[str]
) -> float:
    """Largest share of a structure ``before`` (N,) that is left ``after`` (N,) over the named channels, 0 to 1.

    Channel by channel, or position, which sums up every error of speed, would hide all others. 0 without channels.
    """
    first, last = structures(trials, before), structures(trials, after)
    shares = [last[n] / first[n] if first[n] > 0.0 else 1.0 for n in names]
    return float(np.clip(max(shares, default=0.0), 0.0, 1.0))


def errors(trials: Sequence[Trial], residual: FloatArray) -> Mapping[str, StructuredError]:
    """Per channel the error over the recordings, every sample of which counts the same."""
    noises: dict[str, list[float]] = {}
    measured: dict[str, list[FloatArray]] = {}
    units: dict[str, str] = {}
    for trial in trials:
        units.update(trial.case.measured.units)
        for channel in trial.case.channels:
            noises.setdefault(channel.name, []).append(float(channel.noise / np.sqrt(channel.weight)))
            measured.setdefault(channel.name, []).append(channel.measured)
    found = {}
    for name, parts in split(trials, residual).items():
        sizes = np.array([part.size for part in parts])
        noise = float(np.sqrt(np.average(np.square(noises[name]), weights=sizes)))
        squares = sum(s**2 * float(p @ p) for s, p in zip(noises[name], parts, strict=True))
        mean, deviation = lagged(parts)
        rmse, span = float(np.sqrt(squares / sizes.sum())), signal_range(np.concatenate(measured[name]))
        found[name] = StructuredError(
            rmse=rmse,
            nrmse=rmse / span if span > 0.0 else float("nan"),
            noise=noise,
            unit=units.get(name, "1"),
            samples=int(sizes.sum()),
            structure=float(np.sqrt(max(mean, 0.0))) * noise,
            significance=mean / deviation,
        )
    return found


def errors_by_recording(
    trials: Sequence[Trial], residual: FloatArray
) -> dict[str, Mapping[str, StructuredError]]:
    """Per recording, by its name, the error of each channel."""
    found: dict[str, Mapping[str, StructuredError]] = {}
    position = 0
    for trial in trials:
        size = sum(c.measured.size for c in trial.case.channels)
        found[trial.case.name] = errors((trial,), residual[position : position + size])
        position += size
    return found


def block_gains(
    trials: Sequence[Trial], worse: FloatArray, better: FloatArray, seconds: float = 0.5
) -> FloatArray:
    """Decrease of the squared residuals per block of time (b,), all channels together."""
    return block_squares(trials, worse, seconds) - block_squares(trials, better, seconds)


def block_squares(trials: Sequence[Trial], residual: FloatArray, seconds: float = 0.5) -> FloatArray:
    """Sum of the squared residuals per block of time (b,), all channels together.

    Blocks are long against the correlation of the residuals, so that their scatter says what chance does; shorter
    recordings are cut into no fewer than ``FEWEST``.
    """
    spans = [(min(c.time[0] for c in own), max(c.time[-1] for c in own)) for own in _channels(trials)]
    whole = sum(float(end - begin) for begin, end in spans)
    blocks = max(FEWEST, math.ceil(round(whole / seconds, 6)))
    sums: list[FloatArray] = []
    for trial, (begin, end), squares in zip(trials, spans, per_trial(trials, residual**2), strict=True):
        count = max(1, round(float(end - begin) / whole * blocks))
        own = np.zeros(count)
        for channel in trial.case.channels:
            block = np.floor((channel.time - begin) / (end - begin) * count).astype(int)
            np.add.at(own, np.minimum(block, count - 1), squares[channel.name])
        sums.append(own)
    return np.concatenate(sums)


def _channels(trials: Sequence[Trial]) -> list[Sequence[Channel]]:
    return [trial.case.channels for trial in trials]


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


def relative_consistency(worse: FloatArray, better: FloatArray) -> float:
    """How many standard errors the squared residuals of blocks (b,) fall, each as a share of its own.

    Where errors add up over a recording, as in a position, the last block outweighs all others, and the scatter of the
    gains says nothing; that of their logarithms does (Student's t, as standard deviations of a normal).
    """
    kept = (worse > 0.0) & (better > 0.0)
    if np.count_nonzero(kept) < 3:
        return 0.0
    falls = np.log(worse[kept] / better[kept])
    t = float(falls.mean() / max(falls.std(ddof=1) / np.sqrt(falls.size), 1e-12))
    sigmas = float(norm.isf(student.sf(t, falls.size - 1)))
    return min(sigmas, t)
