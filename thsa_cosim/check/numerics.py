"""Trials of an FMU's numbers: inputs, communication step, both interfaces, start values."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from thsa_cosim.batch import Outcome, Status
from thsa_cosim.batch.handling import HandlingTrial, largest_change, said
from thsa_cosim.batch.own_step import own_step
from thsa_cosim.check.finding import Verdict
from thsa_cosim.fmu.plant import Kind
from thsa_cosim.signals import FloatArray, Signals

STEP_OK, STEP_WARNING = 1e-4, 1e-2
"""Change of an output, relative to its range, when the communication step is halved."""
STEP_FAILED = 0.1
"""Above this change a step is wrong even where a shorter one would do."""
AGREE = 1e-3
"""Deviation between ways of simulating the same that still counts as agreement."""
_FALLS = 0.6
"""Share of the first halving's change below which that of the last one tried is a convergence."""
_FAR = 20.0
"""Ranges of an output over the rest of a run, by which its first value is no value."""
_SHRINKS = 0.2
"""A signal that falls below this share with a hundredth of the tolerance is an error of the solver."""
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


def judge_step(
    first: Signals, outcome: Outcome, step: float, fixed: bool = False, within: bool = True
) -> Judged:
    """What half the communication step changes; ``fixed``: the FMU declares that it takes steps of one size.

    ``within``: its inputs move between communication points, or it has none.
    """
    if not outcome.ok or outcome.signals is None:
        if fixed:
            text = f"it takes steps of {step:g} s only, as it declares: what they cost in accuracy cannot be tried"
            return Verdict.NOT_TRIED, text, {}
        refused = outcome.status in (Status.FMI_ERROR, Status.FMI_DISCARD, Status.INCOMPLETE)
        if refused and "t = 0 s" in outcome.reason:
            text = f"it declares steps of any size, and refuses half of {step:g} s: {outcome.reason}"
            return Verdict.WARNING, text, {}
        return Verdict.WARNING, f"halved, it fails: {outcome.status}: {outcome.reason}", {}
    change, worst = halving(first, outcome.signals)
    verdict = Verdict.FAILED
    if change <= STEP_WARNING:
        verdict = Verdict.OK if change <= STEP_OK else Verdict.WARNING
    own = own_step(outcome.signals.time, outcome.signals.values)
    if own is not None and within and change > STEP_OK:
        text = (
            f"it steps by itself, every {own:.3g} s: communicate so, or at a multiple of it; shorter steps show values"
            f" early ({worst} by {change:.1e} of its range)"
        )
        return Verdict.WARNING, text, {"change": change, "own_step_s": own}
    text = f"halving {step:g} s changes {worst} by {change:.1e} of its range"
    return verdict, text if change else "halving it changes nothing", {"change": change}


def halving(coarse: Signals, fine: Signals) -> tuple[float, str]:
    """What half the step changes, over range, and whose change it is."""
    return largest_change(coarse.values, {n: fine[n][::2] for n in coarse.names}, jumps=True)


def judge_shorter_steps(
    judged: Judged, runs: Sequence[tuple[float, Outcome]], nobodys: bool = False
) -> Judged:
    """Add to the line of a step that is too long the first shorter one whose halving changes little enough.

    ``runs``: (step, outcome), each half of the one before, the first one being half of what was judged.
    ``nobodys``: neither the FMU nor the user says how long a step is, so a shorter one that does is no failure.
    """
    verdict, text, values = judged
    last = 0.0, np.inf
    if nobodys:
        text = f"{text} (a step of this check: the FMU declares none; see --step)"
    for (step, coarse), (_, fine) in pairwise(runs):
        if coarse.signals is None or fine.signals is None:
            break
        change, _ = halving(coarse.signals, fine.signals)
        if change <= STEP_WARNING:
            mild = values.get("change", np.inf) <= STEP_FAILED
            text = f"{text}; halving {step:g} s changes {change:.1e}: use that step"
            return Verdict.WARNING if mild or nobodys else verdict, text, {**values, "usable_step_s": step}
        last = step, change
    if last[1] < _FALLS * values.get("change", 0.0):
        text = f"{text}; it falls with the step, but halving {last[0]:g} s still changes {last[1]:.1e}"
        return Verdict.WARNING if nobodys else verdict, f"{text}: use a shorter one", values
    return verdict, f"{text}, and shorter steps change as much: no step is known to be right", values


def judge_longer_step(first: Signals, outcome: Outcome, step: float, change: float) -> Judged:
    """Whether twice the step is still sound, where half of it changes ``change``."""
    if not outcome.ok or outcome.signals is None:
        return Verdict.OK, f"{2.0 * step:g} s is refused: {outcome.reason}", {}
    count = len(outcome.signals.time)
    reference = {n: first[n][: 2 * count : 2][:count] for n in first.names}
    doubled, worst = largest_change(reference, outcome.signals.values, jumps=True)
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
        change, name = largest_change(coarse.signals.values, found, jumps=True)
        worst = max(worst, change)
        if change > STEP_WARNING:
            text = (
                f"{times:g} times as large ({largest[times]}), halving the step changes {name} by {change:.1e} of its "
                f"range: check it with your own inputs (`check SCENARIO`)"
            )
            return Verdict.WARNING, text, {"change": change}
    return Verdict.OK, f"up to {outcomes[-1][0]:g} times as large, halving the step changes {worst:.1e}", {}


def shrinking(loose: Signals, tight: Signals) -> set[str]:
    """Signals whose size falls with the solver's tolerance: nothing but its errors."""
    return {n for n in loose.names if np.max(np.abs(tight[n])) <= _SHRINKS * np.max(np.abs(loose[n])) != 0.0}


def below(signals: Signals, tolerance: float) -> set[str]:
    """Signals smaller than what the ``tolerance`` lets the largest of their unit err by: a stuck part's creep."""
    largest: dict[str, float] = {}
    size = {n: float(np.max(np.abs(signals[n]))) for n in signals.names}
    for name in signals.names:
        unit = signals.units.get(name, "")
        largest[unit] = max(largest.get(unit, 0.0), size[name])
    known = [n for n in signals.names if signals.units.get(n)]
    return {n for n in known if 0.0 < size[n] < tolerance * largest[signals.units[n]]}


def judge_exchange(first: Signals, outcome: Outcome, zeros: Sequence[str] = ()) -> Judged:
    """Whether both interfaces say the same; ``zeros`` are zero but for the solvers' errors, and are not compared."""
    if not outcome.ok or outcome.signals is None:
        return Verdict.WARNING, f"it fails, Co-Simulation works: {outcome.status}: {outcome.reason}", {}
    names = [n for n in first.names if n not in zeros]
    change, worst = largest_change(first.values, outcome.signals.values, names, jumps=True)
    text = f"{worst} differs from Co-Simulation by {change:.1e} of its range"
    if zeros:
        text += f"; {', '.join(zeros)} not compared: zero but for the solver's errors"
    return Verdict.OK if change <= AGREE else Verdict.WARNING, text, {"change": change}


def judge_changes(first: Signals, outcomes: Mapping[str, Outcome], what: str, untried: int = 0) -> Judged:
    """Which of ``outcomes``, each with one thing changed, differ from the first run at all.

    ``untried``: how many more there are.
    """
    idle = silent(first, outcomes)
    failing = [name for name, outcome in outcomes.items() if not outcome.ok]
    n, quiet = len(outcomes), len(idle)
    values = {"tried": float(n), "silent": float(quiet)}
    text = f"each of {n} changes some output" if not idle else f"{n - quiet} of {n} change some output"
    if idle:
        listed = ", ".join(idle[:12]) + (f" and {quiet - 12} more" if quiet > 12 else "")
        text += f"; nothing changes with {listed}"
    if failing:
        text += f"; the run fails with another {', '.join(failing[:5])}"
    if untried:
        text += f"; {untried} more were not tried"
    if n and quiet == n:
        return Verdict.WARNING, f"no output changes with any of {n} {what}: they are ignored", values
    return Verdict.OK, text, values


def silent(first: Signals, outcomes: Mapping[str, Outcome]) -> list[str]:
    """Names of those of ``outcomes`` that equal the first run."""
    return [
        name
        for name, outcome in outcomes.items()
        if outcome.ok and outcome.signals is not None and same(first.values, outcome.signals.values)
    ]


def judge_first_values(signals: Signals) -> Judged | None:
    """An output whose first value has nothing to do with what follows: it is valid after the first step only."""
    for name, values in signals.values.items():
        span = float(np.ptp(values[1:])) if values.size > 10 else 0.0
        if span > 0.0 and abs(float(values[1] - values[0])) > _FAR * span:
            ends = f"{values[0]:.4g} at the start and {values[1]:.4g} after a step"
            return Verdict.WARNING, f"{name} is {ends}: it is not set before the first step", {}
    return None


def judge_declared(first: Signals, outcome: Outcome) -> Judged | None:
    """Whether parameters that are set to the values that they declare change anything."""
    if not outcome.ok or outcome.signals is None:
        return None
    change, worst = largest_change(first.values, outcome.signals.values)
    if change <= AGREE:
        return None
    text = f"setting its parameters to the values that it declares {said(change, worst)}"
    return Verdict.WARNING, f"{text}: it starts with others", {"change": change}


def judge_memory(growth: float, limit: float, runs: int) -> Judged:
    """Whether memory grows by ``growth`` bytes per run."""
    leaks = growth > limit
    text = f"grows by {growth / 1024:.1f} KiB per run" if leaks else f"steady over {runs} runs"
    return Verdict.WARNING if leaks else Verdict.OK, text, {"growth_bytes_per_run": growth}


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
