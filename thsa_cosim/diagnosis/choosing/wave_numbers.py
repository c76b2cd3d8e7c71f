"""Wave numbers at which the residual repeats over the position of a slot: a periodogram over position, not time.

Blocks of a fraction of a second are summed without regard to phase, since closed loops turn a ripple's phase with speed
(Lomb, Astrophysics and Space Science 39 (1976) 447, for unevenly spaced points).
"""

import itertools
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from thsa_cosim.diagnosis.catalogue.slots import Slot
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.structure import per_trial
from thsa_cosim.signals import FloatArray, Signals

_BLOCK = 512
_PEAKS = 3
#: Share of the steps between samples that a wave number has to be resolved by.
_USUAL = 0.9
#: Periods per revolution that are looked at on a shaft; along a path: periods per largest excursion.
_HARMONICS = np.arange(1.0, 145.0)
_PERIODS = np.arange(4.0, 200.0, 0.25)


def wave_number_finder(
    bench: Bench,
    slots: Sequence[Slot],
    signals_at: Callable[[Mapping[str, Mapping[str, float]]], Mapping[str, Signals]],
    machine: Machine,
) -> Callable[[Fit], Mapping[str, Sequence[float]]]:
    """Return a function: fit → per slot with a position its residuals' wave numbers and the machine's.

    ``signals_at``: start values by case → the position of every slot that has one, by case.
    """
    chosen = [(slot, slot.position) for slot in slots if slot.position is not None]
    trials = bench.of("fit")

    def scan(fit: Fit) -> Mapping[str, Sequence[float]]:
        values = {t.case.name: fit.unknowns.assignments(fit.vector, t.group) for t in trials}
        signals = signals_at(values)
        residuals = per_trial(trials, fit.residual)
        found: dict[str, Sequence[float]] = {}
        for slot, position in chosen:
            positions, own = [], []
            for t, parts in zip(trials, residuals, strict=True):
                run = signals.get(t.case.name)
                if run is not None:
                    times = t.case.channels[0].time
                    positions.append(np.interp(times, run.time, run[position]))
                    own.append([p for p in parts.values() if p.size == times.size])
            reach = max((float(np.max(np.abs(z))) for z in positions), default=1.0) or 1.0
            grid = _HARMONICS if slot.is_angular else 2.0 * np.pi * _PERIODS / reach
            found[slot.name] = (*wave_numbers(positions, own, grid), *machine.starts(slot.name))
        return found

    return scan


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
            # A few late samples among many do not make a wave ambiguous: stamps that scatter have no aliases.
            step = float(np.quantile(np.abs(np.diff(block)), _USUAL))
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
        turn = np.exp(-1j * (grid[1] - grid[0]) * place)
        # Row by row: a seventh of the time of cumprod, which goes down columns.
        for before, after in itertools.pairwise(waves):
            np.multiply(before, turn, out=after)
    return waves
