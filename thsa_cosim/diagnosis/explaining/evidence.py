"""The evidence at a glance: what a balance equation misses, over what it depends on, and what both models say of it.

The balance at fault is formed from the recordings, and from the signals of the declared and of the extended model
alike. Its coefficients are fitted to each anew, so that what re-tuning explains is in none of the curves. The variable
that the measured residual depends on most is called its cause: the largest correlation ratio (R. A. Fisher, Statistical
Methods for Research Workers, 1925).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thsa_cosim.diagnosis.explaining.balance import (
    Record,
    Regression,
    drawings_of,
    formulas_of,
    record_of,
)
from thsa_cosim.diagnosis.fitting.identified import Identified
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.results import Balance, Evidence
from thsa_cosim.inverse_dynamics import low_pass
from thsa_cosim.scenario import BalanceTable, Scenario
from thsa_cosim.signals import FloatArray, Signals

_BINS = 30
#: Independent values that a bin needs to be shown.
_LEAST = 4.0


def evidence(
    scenario: Scenario,
    balances: Sequence[Balance],
    trials: tuple[Trial, ...],
    before: Identified,
    after: Identified | None,
) -> Evidence | None:
    """The residual of the balance at fault over its cause; None where no balance can be formed.

    Held-out recordings are shown if there are any.
    """
    specs = {} if scenario.diagnose is None else {b.name: b for b in scenario.diagnose.balances}
    formed = [b for b in balances if b.equation in specs]
    if not formed:
        return None
    worst = max(formed, key=lambda b: (b.at_fault, b.share))
    spec = specs[worst.equation]
    for part in ("validate", "fit"):
        found = _over_cause(scenario, spec, part, [t for t in trials if t.part == part], before, after)
        if found is not None:
            return found
    return None


def _over_cause(
    scenario: Scenario,
    spec: BalanceTable,
    part: str,
    shown: Sequence[Trial],
    before: Identified,
    after: Identified | None,
) -> Evidence | None:
    groups = [
        g for g in (_residuals(scenario, spec, shown, group, before, after) for group in _groups(shown)) if g
    ]
    if not groups:
        return None
    measured = np.concatenate([g.measured for g in groups])
    causes = {name: np.concatenate([g.causes[name] for g in groups]) for name in groups[0].causes}
    ratios = {name: _ratio(x, measured) for name, x in causes.items()}
    left = _first(spec.left, formulas_of(scenario, spec)[0].names)
    cause = max(ratios, key=lambda name: ratios[name])
    per_value = 1.0 / (2.0 * spec.band * groups[0].step)  # samples to an independent value
    bins = _bins(
        causes[cause], [measured, *(_model(groups, name) for name in ("before", "after"))], per_value
    )
    if bins is None:
        return None
    unit = "s" if cause == "time" else _unit(scenario, cause)
    return Evidence(spec.name, spec.unit, left, part, cause, unit, ratios[cause], *bins)


def _first(text: str, names: Collection[str]) -> str:
    """The one of ``names`` that a formula's text begins with, the same in every run; "" if there is none."""
    return min(names, key=lambda name: (text.find(name), -len(name)), default="")


@dataclass(frozen=True, eq=False)
class _Group:
    """Residuals (m,) of one temperature, measured and by both models, with what they may depend on."""

    measured: FloatArray
    models: Mapping[str, FloatArray | None]
    causes: Mapping[str, FloatArray]
    step: float


def _groups(trials: Sequence[Trial]) -> list[str]:
    return list(dict.fromkeys(t.group for t in trials))


def _residuals(
    scenario: Scenario,
    spec: BalanceTable,
    trials: Sequence[Trial],
    group: str,
    before: Identified,
    after: Identified | None,
) -> _Group | None:
    formulas = formulas_of(scenario, spec)
    recordings = {r.name: r for r in (*scenario.fit, *scenario.validate)}
    own: list[tuple[Trial, Record, Signals]] = []
    for trial in (t for t in trials if t.group == group and t.case.name in recordings):
        recording = recordings[trial.case.name]
        record = record_of(recording, spec, formulas)
        if record is not None:
            own.append((trial, record, recording.compared))
    if not own:
        return None
    records = tuple(record for _, record, _ in own)
    drawing = drawings_of(scenario, tuple(trials))[group]
    measured = Regression(spec.band, records, drawing)
    inside, _ = measured.fit(np.random.default_rng(scenario.seed))
    models: dict[str, FloatArray | None] = {}
    for name, model in (("before", before), ("after", after)):
        simulated = (
            None if model is None else [_simulated(r, model.signals.get(t.name), s) for t, r, s in own]
        )
        known = (
            None
            if simulated is None or any(r is None for r in simulated)
            else tuple(r for r in simulated if r)
        )
        models[name] = None if known is None else Regression(spec.band, known, drawing).project(inside)[0]
    return _Group(measured.project(inside)[0], models, _causes(own), records[0].step)


def _simulated(record: Record, signals: Signals | None, measured: Signals) -> Record | None:
    """The record with a model's outputs in place of the measured ones; inputs stay."""
    if signals is None:
        return None
    grid = measured.time[0] + record.step * np.arange(record.kept.size)
    even = signals.resample(grid)
    return replace(record, values={n: even[n] if n in even.names else v for n, v in record.values.items()})


def _causes(own: Sequence[tuple[Trial, Record, Signals]]) -> dict[str, FloatArray]:
    """Every signal that varies below the band, at the samples that count."""
    found: dict[str, list[FloatArray]] = {}
    for _, record, signals in own:
        even = signals.resample(signals.time[0] + record.step * np.arange(record.kept.size))
        for name in signals.names:
            slow = low_pass(np.nan_to_num(even[name]), record.band, record.step)[record.kept]
            found.setdefault(name, []).append(slow)
        found.setdefault("time", []).append((even.time - even.time[0])[record.kept])
    joined = {name: np.concatenate(parts) for name, parts in found.items() if len(parts) == len(own)}
    return {name: x for name, x in joined.items() if float(np.ptp(x)) > 0.0}


def _index(cause: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """The bin of every sample: of equal width between the outer hundredths."""
    low, high = np.quantile(cause, [0.005, 0.995])
    edges = np.linspace(low, high, _BINS + 1)[1:-1]
    return np.searchsorted(edges, cause, side="right")


def _ratio(cause: FloatArray, residual: FloatArray) -> float:
    """Share of the residual's power that its means in bins of ``cause`` have (0 to 1)."""
    index = _index(cause)
    count = np.bincount(index, minlength=_BINS)
    total = np.bincount(index, residual, minlength=_BINS)
    between = float(np.sum(total**2 / np.maximum(count, 1)))
    power = float(residual @ residual)
    return between / power if power > 0.0 else 0.0


def _model(groups: Sequence[_Group], name: str) -> FloatArray | None:
    parts = [g.models[name] for g in groups]
    known = [p for p in parts if p is not None]
    return np.concatenate(known) if len(known) == len(parts) else None


def _bins(
    cause: FloatArray, residuals: Sequence[FloatArray | None], per_value: float
) -> tuple[tuple[float, ...], ...] | None:
    """Per bin: cause, measured mean, its standard error, and the means of both models (NaN without one)."""
    index = _index(cause)
    count = np.bincount(index, minlength=_BINS).astype(np.float64)
    shown = count / per_value >= _LEAST
    if not shown.any():
        return None

    def mean(values: FloatArray | None) -> FloatArray:
        if values is None:
            return np.full(_BINS, np.nan)
        return np.bincount(index, values, minlength=_BINS) / np.maximum(count, 1.0)

    measured = residuals[0]
    assert measured is not None
    centre, first = mean(cause), mean(measured)
    spread = np.sqrt(np.maximum(mean(measured**2) - first**2, 0.0))
    stderr = spread / np.sqrt(np.maximum(count / per_value, 1.0))
    columns = (centre, first, stderr, *(mean(r) for r in residuals[1:]))
    return tuple(tuple(column[shown].tolist()) for column in columns)


def _unit(scenario: Scenario, name: str) -> str:
    variable = scenario.fmu.variables.get(name)
    return (variable.unit if variable is not None else None) or "1"
