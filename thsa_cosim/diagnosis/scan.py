"""Wave numbers at which the residual repeats over the position of a slot: a periodogram over position, not time.

Blocks of a fraction of a second are summed without regard to phase, since closed loops turn a ripple's phase with speed
(Lomb, Astrophysics and Space Science 39 (1976) 447, for unevenly spaced points).
"""

from collections.abc import Sequence

import numpy as np

from thsa_cosim.signals import FloatArray

_BLOCK = 512
_PEAKS = 3


def wave_numbers(
    position: Sequence[FloatArray],
    residuals: Sequence[Sequence[FloatArray]],
    grid: FloatArray,
    peaks: int = _PEAKS,
) -> tuple[float, ...]:
    """The ``peaks`` wave numbers of ``grid`` (m,), evenly spaced, with the most power, local maxima only.

    ``position`` holds per recording (n,), ``residuals`` per recording its channels (n,) in standard deviations.
    """
    power, weight = np.zeros(grid.size), np.zeros(grid.size)
    for z, channels in zip(position, residuals, strict=True):
        for begin in range(0, z.size - _BLOCK + 1, _BLOCK):
            block = z[begin : begin + _BLOCK]
            travel = float(np.ptp(block))
            resolved = grid * travel > 4.0 * np.pi
            step = float(np.max(np.abs(np.diff(block))))
            resolved &= grid * step < np.pi
            if not resolved.any():
                continue
            place = block - block.mean()
            waves = _waves(grid[resolved], place)
            for channel in channels:
                part = channel[begin : begin + _BLOCK]
                line = np.polynomial.polynomial.polyfit(place, part, 1)
                part = part - np.polynomial.polynomial.polyval(place, line)
                power[resolved] += np.abs(waves @ part) ** 2 / _BLOCK
                weight[resolved] += 1.0
    mean = np.divide(power, weight, out=np.zeros_like(power), where=weight > 4)
    inner = (mean > np.roll(mean, 1)) & (mean >= np.roll(mean, -1))
    order = np.argsort(np.where(inner, -mean, 0.0))
    return tuple(float(grid[k]) for k in order[:peaks] if inner[k] and mean[k] > 0.0)


def _waves(grid: FloatArray, place: FloatArray) -> np.ndarray:
    """exp(-i grid place), (m, n): each row is the one before, turned on, which costs less than exponentials."""
    waves = np.empty((grid.size, place.size), dtype=complex)
    waves[0] = np.exp(-1j * grid[0] * place)
    if grid.size > 1:
        waves[1:] = np.exp(-1j * (grid[1] - grid[0]) * place)
    return np.cumprod(waves, axis=0, out=waves)
