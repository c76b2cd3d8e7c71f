"""Trials of an FMU's numbers: inputs, communication step, both interfaces, start values."""

from collections.abc import Mapping, Sequence

import numpy as np

from thsa_cosim.batch import Outcome
from thsa_cosim.batch.handling import HandlingTrial, largest_change
from thsa_cosim.check.finding import Verdict
from thsa_cosim.fmu.plant import Kind
from thsa_cosim.signals import FloatArray, Signals

STEP_OK, STEP_WARNING = 1e-4, 1e-2
"""Change of an output, relative to its range, when the communication step is halved."""
AGREE = 1e-3
"""Deviation between ways of simulating the same that still counts as agreement."""
Judged = tuple[Verdict, str, dict[str, float]]


def judge_handling(trial: HandlingTrial, kind: Kind) -> Judged:
    """How inputs reach the FMU, by what the trial found."""
    if kind == "model-exchange":
        return Verdict.OK, "applied at every evaluation, exactly (Model Exchange)", {}
    best = trial.best
    if best is None:
        return Verdict.NOT_TRIED, trial.sentence(), {}
    errors = {f"error_{way.mode}": way.error for way in trial.ways if np.isfinite(way.error)}
    if best.error <= AGREE:
        return Verdict.OK, trial.sentence(), errors
    remedy = "use Model Exchange" if trial.exchange_confirmed else "use a shorter step"
    return Verdict.WARNING, f"{trial.sentence()}; {remedy}", errors


def judge_step(first: Signals, outcome: Outcome, step: float) -> Judged:
    """What half the communication step changes."""
    if not outcome.ok or outcome.signals is None:
        return Verdict.WARNING, f"halved, it fails: {outcome.status}: {outcome.reason}", {}
    change, worst = largest_change(first.values, {n: outcome.signals[n][::2] for n in first.names})
    verdict = Verdict.FAILED
    if change <= STEP_WARNING:
        verdict = Verdict.OK if change <= STEP_OK else Verdict.WARNING
    text = f"halving {step:g} s changes {worst} by {change:.1e} of its range"
    return verdict, text if change else "halving it changes nothing", {"change": change}


def judge_longer_step(first: Signals, outcome: Outcome, step: float, change: float) -> Judged:
    """Whether twice the step is still sound, where half of it changes ``change``."""
    if not outcome.ok or outcome.signals is None:
        return Verdict.OK, f"{2.0 * step:g} s is refused: {outcome.reason}", {}
    count = len(outcome.signals.time)
    reference = {n: first[n][: 2 * count : 2][:count] for n in first.names}
    doubled, worst = largest_change(reference, outcome.signals.values)
    if doubled <= max(STEP_WARNING, 30.0 * change):
        return (
            Verdict.OK,
            f"doubling {step:g} s changes {worst} by {doubled:.1e} of its range",
            {"change": doubled},
        )
    text = f"doubling {step:g} s changes {worst} by {doubled:.1e} of its range, without an error: never step longer"
    return Verdict.WARNING, text, {"change": doubled}


def judge_larger_inputs(
    outcomes: Sequence[tuple[float, Outcome, Outcome]], largest: Mapping[float, str]
) -> Judged:
    """Whether halving the step still changes little with inputs some times as large."""
    worst = 0.0
    for times, coarse, half in outcomes:
        if coarse.signals is None or half.signals is None:
            return (
                Verdict.OK,
                f"{times:g} times as large it fails, and says so: {coarse.reason or half.reason}",
                {},
            )
        found = {n: v[::2] for n, v in half.signals.values.items()}
        change, name = largest_change(coarse.signals.values, found)
        worst = max(worst, change)
        if change > STEP_WARNING:
            text = (
                f"{times:g} times as large ({largest[times]}), halving the step changes {name} by {change:.1e} of its "
                f"range: check it with your own inputs (`check SCENARIO`)"
            )
            return Verdict.WARNING, text, {"change": change}
    return Verdict.OK, f"up to {outcomes[-1][0]:g} times as large, halving the step changes {worst:.1e}", {}


def judge_exchange(first: Signals, outcome: Outcome) -> Judged:
    """Whether both interfaces say the same."""
    if not outcome.ok or outcome.signals is None:
        return Verdict.WARNING, f"it fails, Co-Simulation works: {outcome.status}: {outcome.reason}", {}
    change, worst = largest_change(first.values, outcome.signals.values)
    text = f"{worst} differs from Co-Simulation by {change:.1e} of its range"
    return Verdict.OK if change <= AGREE else Verdict.WARNING, text, {"change": change}


def judge_changes(first: Signals, outcomes: Mapping[str, Outcome], what: str) -> Judged:
    """Which of ``outcomes``, each with one thing changed, differ from the first run at all."""
    silent = [
        name
        for name, outcome in outcomes.items()
        if outcome.ok and outcome.signals is not None and same(first.values, outcome.signals.values)
    ]
    failing = [name for name, outcome in outcomes.items() if not outcome.ok]
    n, quiet = len(outcomes), len(silent)
    values = {"tried": float(n), "silent": float(quiet)}
    text = f"each of {n} changes some output" if not silent else f"{n - quiet} of {n} change some output"
    if silent:
        listed = ", ".join(silent[:12]) + (f" and {quiet - 12} more" if quiet > 12 else "")
        text += f"; nothing changes with {listed}"
    if failing:
        text += f"; the run fails with another {', '.join(failing[:5])}"
    if n and quiet == n:
        return Verdict.WARNING, f"no output changes with any of {n} {what}: they are ignored", values
    return Verdict.OK, text, values


def same(one: Mapping[str, FloatArray], other: Mapping[str, FloatArray]) -> bool:
    """Whether two runs are alike, bit for bit."""
    return all(np.array_equal(one[name], other[name]) for name in one)


def moves(signals: Signals | None) -> bool:
    """Whether any output moves, by more than rounding."""
    if signals is None:
        return False
    return any(
        np.ptp(v) > 1e-12 * float(np.max(np.abs(v))) and np.ptp(v) > 0.0 for v in signals.values.values()
    )
