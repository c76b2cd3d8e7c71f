"""Starts for wave numbers: what the residual repeats over, slot by slot."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from thsa_cosim.diagnosis.bench import Bench
from thsa_cosim.diagnosis.fit import Fit
from thsa_cosim.diagnosis.scan import wave_numbers
from thsa_cosim.diagnosis.slots import Slot
from thsa_cosim.diagnosis.structure import per_trial
from thsa_cosim.signals import Signals

#: Periods per revolution that are looked at on a shaft; along a path: periods per largest excursion.
_HARMONICS = np.arange(1.0, 61.0)
_PERIODS = np.arange(4.0, 200.0, 0.25)


def scanner(
    bench: Bench,
    slots: Sequence[Slot],
    signals_at: Callable[[Mapping[str, Mapping[str, float]]], Mapping[str, Signals]],
) -> Callable[[Fit], Mapping[str, Sequence[float]]]:
    """Return a function: fit → per friction slot the wave numbers at which its residuals repeat.

    ``signals_at``: start values by case → ``<slot's component>.z`` of every friction slot by case.
    """
    chosen = [slot for slot in slots if slot.interface == "FrictionEffect"]
    trials = bench.of("fit")

    def scan(fit: Fit) -> Mapping[str, Sequence[float]]:
        values = {t.case.name: fit.unknowns.assignments(fit.vector, t.group) for t in trials}
        signals = signals_at(values)
        residuals = per_trial(trials, fit.residual)
        found: dict[str, Sequence[float]] = {}
        for slot in chosen:
            positions, own = [], []
            for t, parts in zip(trials, residuals, strict=True):
                run = signals.get(t.case.name)
                if run is not None:
                    times = t.case.channels[0].time
                    positions.append(np.interp(times, run.time, run[f"{slot.component}.z"]))
                    own.append([p for p in parts.values() if p.size == times.size])
            angular = slot.units.get("z") == "rad"
            reach = max((float(np.max(np.abs(z))) for z in positions), default=1.0) or 1.0
            grid = _HARMONICS if angular else 2.0 * np.pi * _PERIODS / reach
            found[slot.name] = wave_numbers(positions, own, grid)
        return found

    return scan
