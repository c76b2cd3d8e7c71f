"""The experiment that would tell rivals apart: of what the rig can run, where the refitted rivals differ most.

T-optimal design between rival models (A. Atkinson, V. Fedorov, Biometrika 62 (1975) 57), over a menu of profiles in
place of a continuous design.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from thsa_cosim.batch import Experiment, Job, Status
from thsa_cosim.diagnosis.choosing.attribution import Attribution
from thsa_cosim.diagnosis.choosing.score import Scored, fixed_shapes
from thsa_cosim.diagnosis.explaining.profiles import Profile, input_range, profiles, travel
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.results import SeparatingExperiment
from thsa_cosim.scenario import DiagnoseSpec, OpenRunner, Scenario
from thsa_cosim.signals import FloatArray, Signals

#: Longest experiment that is tried, in s, and how many samples it has at most.
_LONGEST, _SAMPLES = 12.0, 12001


def separating_experiment(
    scenario: Scenario,
    spec: DiagnoseSpec,
    found: Attribution,
    trials: Sequence[Trial],
    open_runner: OpenRunner,
) -> SeparatingExperiment | None:
    """The profile of ``spec.command`` and ``spec.load`` at which an effect and its rival differ most.

    ``trials`` run the model that holds all effects. The first pair that the recordings cannot distinguish counts, else
    the first effect and its runner-up. ``distance`` is the sum over the outputs' samples of the squared difference of
    both models, as fitted to the present recordings, in variances of the noise; ``present`` the same on the fit
    recordings, for as long a time. The other inputs are held at what they were in the first fit recording. None
    without an accepted effect, a second candidate or a command.
    """
    pair, factors = _rivals(found)
    fit = [t for t in trials if t.part == "fit"]
    if pair is None or spec.command is None or not fit:
        return None
    first = fit[0]
    recorded = [t.case.inputs for t in fit]
    step = float(np.median(np.diff(first.case.time)))
    lasting = min(_LONGEST, max(float(s.time[-1] - s.time[0]) for s in recorded), _SAMPLES * step)
    time = np.asarray(step * np.arange(int(lasting / step) + 1), dtype=np.float64)
    menu = profiles(
        time,
        input_range(recorded, spec.command),
        None if spec.load is None else input_range(recorded, spec.load),
        travel(recorded, spec.command),
    )
    inputs = [_inputs(first.case.inputs, time, spec, profile) for profile in menu]
    experiments = [replace(_experiment(first, own), name=p.name) for p, own in zip(menu, inputs, strict=True)]
    jobs = [
        Job(e.name, _values(scored, first.group), keep_signals=True) for e in experiments for scored in pair
    ]
    if not jobs:
        return None
    with open_runner(scenario.simulation, experiments) as runner:
        outcomes = runner.run(jobs)
    weights = {c.name: c.weight / c.noise**2 for c in first.case.channels}
    best: SeparatingExperiment | None = None
    for k, (profile, own) in enumerate(zip(menu, inputs, strict=True)):
        one, other = outcomes[2 * k : 2 * k + 2]
        if (
            one.status != Status.OK
            or other.status != Status.OK
            or one.signals is None
            or other.signals is None
        ):
            continue
        distance = _distance(one.signals, other.signals, weights)
        if best is None or distance > best.distance:
            names = (pair[0].candidate.name, pair[1].candidate.name)
            present = _present(pair, factors, fit, time.size)
            best = SeparatingExperiment(profile.name, names, distance, present, own)
    return best


def _rivals(found: Attribution) -> tuple[tuple[Scored, Scored] | None, FloatArray]:
    """An accepted effect and what the recordings cannot tell from it, else the first one and the best of the others.

    And the factors (N,) that the residuals of their fits hold.
    """
    kept = [r for r in found.rounds if r.accepted is not None and r.accepted in found.accepted]
    for one in kept:
        if one.rivals and one.accepted is not None:
            return (one.accepted, one.rivals[0]), one.factors
    for one in kept[:1]:
        winner = one.accepted
        others = (s for s in one.scored if s.candidate.effect.name != winner.candidate.effect.name)  # type: ignore[union-attr]
        if winner is not None and (second := next(others, None)) is not None:
            return (winner, second), one.factors
    return None, np.zeros(0)


def _values(scored: Scored, group: str) -> Mapping[str, float]:
    return {**fixed_shapes([scored]), **scored.fit.unknowns.assignments(scored.fit.vector, group)}


def _inputs(recorded: Signals, time: FloatArray, spec: DiagnoseSpec, profile: Profile) -> Signals:
    """The recording's inputs with the profile in place of command and load, the others at their first value."""
    values = {name: np.full(time.size, recorded[name][0]) for name in recorded.names}
    assert spec.command is not None
    values[spec.command] = profile.command
    if spec.load is not None and profile.load is not None:
        values[spec.load] = profile.load
    return Signals(time, values, recorded.units, recorded.held - {spec.command, spec.load})


def _experiment(trial: Trial, inputs: Signals) -> Experiment:
    return replace(trial.case, inputs=inputs, time=inputs.time).experiment(trial.name, None)


def _distance(one: Signals, other: Signals, weights: Mapping[str, float]) -> float:
    return float(sum(w * np.sum((one[n] - other[n]) ** 2) for n, w in weights.items()))


def _present(pair: tuple[Scored, Scored], factors: FloatArray, fit: Sequence[Trial], samples: int) -> float:
    """Distance of both on the fit recordings, scaled to ``samples`` of every output."""
    difference = (pair[0].fit.residual - pair[1].fit.residual) / factors
    recorded = sum(t.case.channels[0].measured.size for t in fit)
    return float(difference @ difference) * samples / recorded
