"""On what the residual depends: its mean in bins of every signal, before and after."""

from collections.abc import Mapping

import numpy as np

from thsa_cosim.diagnosis.fitting.identified import Identified
from thsa_cosim.diagnosis.fitting.structure import per_trial
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.results import Dependence
from thsa_cosim.scenario import Scenario
from thsa_cosim.signals import FloatArray

_BINS = 24


def dependence(
    scenario: Scenario, trials: tuple[Trial, ...], before: Identified, after: Identified
) -> tuple[Dependence, ...]:
    """Bins of equal count over time and every signal of the held-out recordings, for every compared channel."""
    held_out = [t for t in trials if t.part == "validate"]
    variables: dict[str, tuple[str, list[FloatArray]]] = {}
    for trial in held_out:
        times = trial.case.channels[0].time
        own = {"time": ("s", times - times[0])}
        for signals in (trial.case.inputs, trial.case.measured):
            for name in signals.names:
                own[name] = (signals.units.get(name, "1"), signals.resample(times)[name])
        for name, (unit, values) in own.items():
            variables.setdefault(name, (unit, []))[1].append(values)
    left, right = _per_channel(held_out, before.validate), _per_channel(held_out, after.validate)
    units = {c.name: scenario.fmu.variables[c.name].unit or "1" for c in held_out[0].case.channels}
    found: list[Dependence] = []
    for variable, (unit, parts) in variables.items():
        x = np.concatenate(parts)
        if float(np.ptp(x)) == 0.0:
            continue
        edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, _BINS + 1)))
        if edges.size < 4:
            continue
        index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, edges.size - 2)
        for channel, first in left.items():
            if channel == variable:
                continue
            for k in range(edges.size - 1):
                inside = index == k
                count = int(np.count_nonzero(inside))
                if count < 8:
                    continue
                last = right[channel][inside]
                found.append(
                    Dependence(
                        variable,
                        float(x[inside].mean()),
                        unit,
                        channel,
                        units[channel],
                        float(first[inside].mean()),
                        float(last.mean()),
                        float(last.std() / np.sqrt(count)),
                    )
                )
    return tuple(found)


def _per_channel(trials: list[Trial], residual: FloatArray) -> Mapping[str, FloatArray]:
    """Residuals in the channels' units (all held-out recordings one after the other)."""
    parts: dict[str, list[FloatArray]] = {}
    for trial, own in zip(trials, per_trial(trials, residual), strict=True):
        for channel in trial.case.channels:
            unit = channel.noise / np.sqrt(channel.weight)
            parts.setdefault(channel.name, []).append(own[channel.name] * unit)
    return {name: np.concatenate(p) for name, p in parts.items()}
