"""The force residual of simulated recordings: what their force law lacks, beside what chance leaves."""

import math
from collections.abc import Sequence

import numpy as np

from thsa_cosim.identify.results import ForceBalance
from thsa_cosim.inverse_dynamics import force_residual, repeatability
from thsa_cosim.scenario import ForceSpec
from thsa_cosim.signals import FloatArray
from thsa_cosim.study import Comparison

#: Laps are of one motion if their positions differ by less than this share of the stroke (rms).
SAME_MOTION = 0.01


def force_balance(
    spec: ForceSpec, comparisons: Sequence[Comparison], masses: Sequence[float]
) -> ForceBalance | None:
    """Force residual of simulated recordings, given the mass in each; None without recordings.

    Raises
    ------
    ValueError
        If a recording is too short, or sampled too slowly, for the band.
    """
    if not comparisons:
        return None
    residuals: dict[str, list[FloatArray]] = {}
    between_laps: list[tuple[float, int]] = []
    for comparison, mass in zip(comparisons, masses, strict=True):
        found = force_residual(
            comparison.measured,
            comparison.simulated,
            position=spec.position,
            force=spec.force,
            mass=mass,
            band=spec.band,
        )
        residual = found[spec.force]
        residuals.setdefault(comparison.role, []).append(residual)
        if spec.period is not None and _repeats(comparison, spec.position, spec.period):
            samples_per_lap = round(spec.period * (residual.size - 1) / (found.time[-1] - found.time[0]))
            between_laps.append((repeatability(residual, samples_per_lap), residual.size))
    known = [(value, weight) for value, weight in between_laps if not math.isnan(value)]
    return ForceBalance(
        unit=comparisons[0].measured.units[spec.force],
        band=spec.band,
        rms={role: float(np.sqrt(np.mean(np.concatenate(r) ** 2))) for role, r in residuals.items()},
        repeatability=math.sqrt(sum(v**2 * w for v, w in known) / sum(w for _, w in known))
        if known
        else math.nan,
    )


def _repeats(comparison: Comparison, position: str, period: float) -> bool:
    """Whether the measured position after a ``period`` is what it was: a record of another motion has other laps."""
    time, q = comparison.measured.time, comparison.measured[position]
    before = time[time + period <= time[-1]]
    if before.size < 2:
        return False
    apart = np.interp(before + period, time, q) - q[: before.size]
    return float(np.sqrt(np.mean(apart**2))) < SAME_MOTION * float(np.ptp(q))
