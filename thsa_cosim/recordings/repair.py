"""Repairs that a scenario asks for: which samples do not count, and what stands in their place.

A sample that is left out is never compared. Since an FMU has to be driven all the time, and filters want a value, the
straight line between its neighbours takes its place.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from thsa_cosim.errors import RecordingError
from thsa_cosim.recordings.independence import independence
from thsa_cosim.recordings.noise import noise_estimate
from thsa_cosim.recordings.outliers import Mask, spikes
from thsa_cosim.signals import FloatArray


@dataclass(frozen=True)
class Repair:
    """What to leave out of one signal.

    Parameters
    ----------
    missing
        Numbers of the file that mean that there is no value; with any list, also an empty one, so do blank cells.
        None: a blank cell is an error.
    below, above
        Samples at or beyond these, in the FMU variable's unit, are left out: a clipped sample is a bound, no value.
    mask
        Stretches (from, to) in s of the file's time that are left out.
    despike
        Leave out spikes of one or two samples (Hampel).
    independent
        Leave out all samples that are held or interpolated.
    fill
        s; the longest stretch of an input that a straight line may bridge.
    """

    missing: tuple[float, ...] | None = None
    below: float | None = None
    above: float | None = None
    mask: tuple[tuple[float, float], ...] = ()
    despike: bool = False
    independent: bool = False
    fill: float = 0.1


@dataclass(frozen=True, eq=False)
class Repaired:
    """``values`` (n,) with straight lines over what is ``left_out`` (n,); ``done`` says what, as sentences."""

    values: FloatArray
    left_out: Mask
    done: tuple[str, ...] = field(default=())


def coded(raw: FloatArray, repair: Repair) -> Mask:
    """Return which of (n,) numbers of the file are no values by ``repair.missing``."""
    if repair.missing is None:
        return np.zeros(raw.shape, dtype=np.bool_)
    return np.asarray(np.isin(raw, repair.missing) | ~np.isfinite(raw))


def repaired(
    path: Path,
    signal: str,
    time: FloatArray,
    values: FloatArray,
    missing: Mask,
    repair: Repair,
    *,
    driven: bool,
) -> Repaired:
    """Apply ``repair`` to (n,) ``values`` at ``time`` s, of which ``missing`` are none.

    Raises
    ------
    RecordingError
        If fewer than two samples are left, or a ``driven`` signal would be bridged for longer than ``fill``.
    """
    out, done = missing.copy(), []

    def leave(which: Mask, why: str) -> None:
        count = int(np.sum(which & ~out))
        if count:
            out[which] = True
            done.append(f"{signal}: {count} of {values.size} samples left out: {why}")

    if missing.any():
        done.append(f"{signal}: {int(np.sum(missing))} of {values.size} samples left out: they hold no value")
    for begin, end in repair.mask:
        leave((time >= begin) & (time <= end), f"masked from {begin:g} s to {end:g} s")
    with np.errstate(invalid="ignore"):
        if repair.above is not None:
            leave(values >= repair.above, f"at or above {repair.above:g}, where it is clipped")
        if repair.below is not None:
            leave(values <= repair.below, f"at or below {repair.below:g}, where it is clipped")
    if repair.independent and np.sum(~out) > 2:
        index = np.flatnonzero(~out)
        found = independence(values[index])
        if found.kind:
            dependent = np.ones(values.shape, dtype=np.bool_)
            dependent[index[found.fresh]] = False
            leave(dependent, f"{found.kind}, one in {found.period:.3g} is measured")
    if repair.despike and np.sum(~out) > 2:
        index = np.flatnonzero(~out)
        found_spikes = np.zeros(values.shape, dtype=np.bool_)
        found_spikes[index] = spikes(values[index], noise_estimate(values[index]))
        leave(found_spikes, "spikes")
    if not done:
        return Repaired(values, out)
    kept = ~out
    if np.sum(kept) < 2:
        raise RecordingError(
            f"{path}: the repairs leave {int(np.sum(kept))} samples of {signal!r}; leave out fewer."
        )
    if driven and not repair.independent:
        longest = float(np.max(np.diff(time[kept])))
        if longest > max(repair.fill, 3.0 * float(np.median(np.diff(time)))):
            raise RecordingError(
                f"{path}: input {signal!r} has no value for {longest:.3g} s; cut the recording there"
                f" (recordings.time.start, .stop) or raise recordings.columns.{signal}.fill."
            )
    return Repaired(np.asarray(np.interp(time, time[kept], values[kept])), out, tuple(done))
