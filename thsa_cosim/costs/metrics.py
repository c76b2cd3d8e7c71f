"""Metrics of a response: pure functions on arrays of one length n, time in s.

A metric that the data do not define (a level never reached, an empty window) is NaN, never an
exception: a simulation that fell short is a result like any other.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def rmse(measured: FloatArray, simulated: FloatArray) -> float:
    """Root mean square of ``simulated - measured``, both (n,), in the signal's unit; NaN when n = 0."""
    if measured.size == 0:
        return float("nan")
    error = simulated - measured
    largest = float(np.max(np.abs(error)))
    if largest == 0.0 or not np.isfinite(largest):
        return largest
    return largest * float(np.sqrt(np.mean((error / largest) ** 2)))  # no overflow in the square


def signal_range(measured: FloatArray) -> float:
    """Largest minus smallest sample of ``measured`` (n,), in its unit; NaN when n = 0."""
    return float(np.ptp(measured)) if measured.size else float("nan")


def nrmse(measured: FloatArray, simulated: FloatArray) -> float:
    """Rmse over the range of ``measured``, both (n,); dimensionless, NaN for a constant signal."""
    span = signal_range(measured)
    return rmse(measured, simulated) / span if span > 0.0 else float("nan")


def first_reach(
    time: FloatArray,
    response: FloatArray,
    final: float,
    fraction: float = 0.95,
    *,
    start: float | None = None,
) -> float:
    """Time in s from ``start`` until ``response`` first reaches ``fraction`` of ``final``.

    Linear between samples. ``start`` defaults to the first sample: for a recording that begins with its
    command this is the rise time t_r of the article's table IV (fraction 0.95). ``final`` may be negative;
    NaN when the level is never reached or ``final`` is 0.
    """
    begin = float(time[0]) if start is None else start
    if final == 0.0:
        return float("nan")
    share = response / final
    after = (share >= fraction) & (time >= begin)
    if not after.any():
        return float("nan")
    k = int(np.argmax(after))
    if k == 0 or share[k - 1] >= fraction:
        return float(time[k]) - begin
    weight = (fraction - share[k - 1]) / (share[k] - share[k - 1])
    return max(0.0, float(time[k - 1] + weight * (time[k] - time[k - 1])) - begin)


def rise_time(
    time: FloatArray,
    response: FloatArray,
    final: float,
    *,
    low: float = 0.1,
    high: float = 0.9,
    start: float | None = None,
) -> float:
    """Time in s between the first crossings of ``low`` and ``high`` of ``final`` (10 to 90 % by default)."""
    lower = first_reach(time, response, final, low, start=start)
    upper = first_reach(time, response, final, high, start=start)
    return upper - lower


def steady_state_error(
    time: FloatArray, response: FloatArray, command: FloatArray, window: tuple[float, float]
) -> float:
    """Mean of ``1 - response/command`` over ``window`` (s, both ends included); dimensionless.

    Samples with a zero command are left out. The article's table IV uses 1.0 to 1.2 s.
    """
    inside = (time >= window[0]) & (time <= window[1]) & (command != 0.0)
    if not inside.any():
        return float("nan")
    return float(np.mean(1.0 - response[inside] / command[inside]))


def overshoot(response: FloatArray, final: float) -> float:
    """Largest excess over ``final`` as a share of it; 0 when it is never exceeded, NaN for a final 0."""
    if final == 0.0 or response.size == 0:
        return float("nan")
    return max(0.0, float(np.max(response / final)) - 1.0)


def settling_time(
    time: FloatArray, response: FloatArray, final: float, band: float = 0.02, *, start: float | None = None
) -> float:
    """Time in s from ``start`` after which ``response`` stays within ``band`` (a share) of ``final``.

    NaN when the last sample is still outside the band.
    """
    begin = float(time[0]) if start is None else start
    if final == 0.0:
        return float("nan")
    outside = np.flatnonzero((np.abs(response / final - 1.0) > band) & (time >= begin))
    if outside.size == 0:
        return 0.0
    last = int(outside[-1])
    return float("nan") if last + 1 >= time.size else float(time[last + 1]) - begin
