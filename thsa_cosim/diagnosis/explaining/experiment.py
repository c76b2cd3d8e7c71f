"""The next experiment: of what the rig can run, what distinguishes rivals, or else makes an effect's values sure.

A menu of profiles in place of a continuous design: each is simulated with the accepted effect and with its rivals, what
the rig cannot do is left out, and the most promising ones are judged with the rivals fitted to them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice, permutations, product

import numpy as np

from thsa_cosim.batch import Experiment, Job, Runner, Status
from thsa_cosim.diagnosis.choosing.attribution import Attribution
from thsa_cosim.diagnosis.choosing.gates import SIGMAS
from thsa_cosim.diagnosis.choosing.places import is_same_law
from thsa_cosim.diagnosis.choosing.rounds import Round
from thsa_cosim.diagnosis.choosing.score import Scored, fixed_shapes
from thsa_cosim.diagnosis.choosing.selection import APART_SHARE
from thsa_cosim.diagnosis.choosing.verdict import SIGNIFICANT, VISIBLE, is_visible
from thsa_cosim.diagnosis.explaining.design import expected_errors, expected_gain
from thsa_cosim.diagnosis.explaining.profiles import TRAVEL, Profile, input_range, profiles, travel
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.structure import errors
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.results import SeparatingExperiment, Sharpened
from thsa_cosim.scenario import DiagnoseSpec, OpenRunner, Scenario
from thsa_cosim.signals import FloatArray, Signals

#: Longest experiment that is tried where no limit says else, in s, and how many samples it has at most.
LONGEST, SAMPLES = 12.0, 12001
#: An output may go this much beyond what was recorded, as a share of its range, where no limit says else.
MARGIN = 0.2
#: Profiles that are judged by the rivals fitted to them, the most promising first.
JUDGED = 5
#: So many of them for the size of the gap alone, the others for its size beside that of the effect.
FARTHEST = 3
#: Profiles that are judged by how sure they make a value.
SHARPENED = 3
#: Rivals that are told apart at a time.
MOST_RIVALS = 3
#: An expected gap this many times what the decision asks for is counted on.
SAFETY = 2.0
#: Difference step of an unknown, in standard errors of the present recordings.
STEP = 3.0


def separating_experiment(
    scenario: Scenario,
    spec: DiagnoseSpec,
    found: Attribution,
    trials: Sequence[Trial],
    stated: Mapping[str, float],
    open_runner: OpenRunner,
) -> SeparatingExperiment | None:
    """The profile of ``spec.command`` and ``spec.load`` that says most, within the rig's limits.

    ``trials`` run the model that holds all effects. With a tie it is the one at which the accepted effect and its
    rivals differ most once each rival is fitted to it; without one, that which makes the least certain value of the
    first effect surest: its ``stated`` standard error (by name, in its unit) times what the profile is expected to make
    of it. A tie between two shafts of a rigid gear counts only where there is no other. The other inputs are held at
    what they were in the first fit recording. None without an accepted effect, a command, or a profile that keeps the
    limits.
    """
    fit = [t for t in trials if t.part == "fit"]
    kept = [r for r in found.rounds if r.accepted is not None and r.accepted in found.accepted]
    if spec.command is None or not fit or not kept:
        return None
    one, rivals = _to_separate(kept)
    assert one.accepted is not None
    models = (one.accepted, *rivals[:MOST_RIVALS])
    menu = _menu(spec, fit)
    if not menu:
        return None
    experiments = [replace(_experiment(fit[0], own), name=profile.name) for profile, own in menu]
    # One set of processes for all of it: opening them for every profile took longer than the runs.
    with open_runner(scenario.simulation, experiments) as runner:
        return _Plan(spec, fit, one, models, stated, menu, runner).best()


def _to_separate(kept: Sequence[Round]) -> tuple[Round, Sequence[Scored]]:
    """The first round with rivals that a profile may distinguish, and these; else the first with any, or the first."""
    for one in kept:
        accepted = one.accepted
        assert accepted is not None
        told = [r for r in one.rivals if not is_same_law(accepted.candidate, r.candidate)]
        if told:
            return one, told
    one = next((r for r in kept if r.rivals), kept[0])
    return one, one.rivals


@dataclass(frozen=True, eq=False)
class _Ran:
    """A profile with the weighted outputs (N,) of every model, and how far the outputs go."""

    profile: Profile
    inputs: Signals
    outputs: tuple[FloatArray, ...]
    reached: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class _Plan:
    """The search over the menu; ``models``: the accepted effect and its rivals, as fitted in ``one`` round.

    ``stated``: standard errors of the identified values. ``menu``: profiles with their inputs; ``runner`` runs them.
    """

    spec: DiagnoseSpec
    fit: Sequence[Trial]
    one: Round
    models: tuple[Scored, ...]
    stated: Mapping[str, float]
    menu: Sequence[tuple[Profile, Signals]]
    runner: Runner

    def best(self) -> SeparatingExperiment | None:
        """The best profile of those that keep the limits."""
        ran = self._ran()
        if not ran:
            return None
        if len(self.models) == 1:
            return self._sharpest(ran)
        judged = [(*self._judged(r), r) for r in self._promising(ran)]
        gaps, effect, best = max(judged, key=lambda one: _worth(min(one[0]), self._wanted(*one[1:])))
        worst = int(np.argmin(gaps))
        names = tuple(m.candidate.name for m in self.models)
        return SeparatingExperiment(
            best.profile.name,
            names,
            _distances(best)[worst],
            self._present(worst + 1, best.inputs.time.size),
            best.inputs,
            expected=gaps[worst],
            separates=gaps[worst] >= SAFETY * self._wanted(effect, best),
            reached=best.reached,
        )

    def _promising(self, ran: Sequence[_Ran]) -> list[_Ran]:
        """The profiles in which the models are farthest apart, absolutely and beside what the effect does there."""
        apart = [min(_distances(r)) for r in ran]
        without = self._without(ran)
        beside = [d / self._wanted(effect, r) for d, effect, r in zip(apart, without, ran, strict=True)]
        order = [*np.argsort(-np.array(apart))[:FARTHEST], *np.argsort(-np.array(beside))]
        # Fitted, rivals only come nearer: where none is apart as it is, no profile is worth a closer look.
        most = JUDGED if max(apart) >= SAFETY * SIGMAS**2 else 1
        return [ran[k] for k in dict.fromkeys(map(int, order))][:most]

    def _ran(self) -> list[_Ran]:
        """Every profile of the menu that all models can run within the limits."""
        vectors = [m.fit.vector for m in self.models]
        outcomes = self._run([p for p, _ in self.menu], list(zip(self.models, vectors, strict=True)))
        ran = []
        for (profile, own), signals in zip(self.menu, outcomes, strict=True):
            runs = [s for s in signals if s is not None]
            if len(runs) == len(self.models) and all(self._keeps(s) for s in runs):
                ran.append(_Ran(profile, own, tuple(map(self._weighted, runs)), _reached(runs[0])))
        return ran

    def _run(
        self, menu: Sequence[Profile], vectors: Sequence[tuple[Scored, FloatArray]]
    ) -> list[list[Signals | None]]:
        """The outputs of every profile (rows) under every model with its vector."""
        jobs = [
            Job(profile.name, self._values(model, vector), keep_signals=True)
            for profile, (model, vector) in product(menu, vectors)
        ]
        outcomes = iter(self.runner.run(jobs))
        return [
            [o.signals if o.status == Status.OK else None for o in islice(outcomes, len(vectors))]
            for _ in menu
        ]

    def _values(self, model: Scored, vector: FloatArray) -> Mapping[str, float]:
        return {**fixed_shapes([model]), **model.fit.unknowns.assignments(vector, self.fit[0].group)}

    def _keeps(self, outputs: Signals) -> bool:
        """Whether every output stays in its limits, or near what was recorded."""
        for channel in self.fit[0].case.channels:
            if channel.name in outputs.names:
                low, high = self._limits(channel.name)
                if outputs[channel.name].min() < low or outputs[channel.name].max() > high:
                    return False
        return True

    def _limits(self, name: str) -> tuple[float, float]:
        """Lowest and highest value of an output; what never moved in the recordings limits nothing."""
        if name in self.spec.limits.range:
            return self.spec.limits.range[name]
        measured = [c.measured for t in self.fit for c in t.case.channels if c.name == name]
        low, high = min(float(m.min()) for m in measured), max(float(m.max()) for m in measured)
        margin = MARGIN * (high - low)
        return (low - margin, high + margin) if margin > 0.0 else (-np.inf, np.inf)

    def _factor(self, name: str) -> float:
        """What the round weighed the residuals of a channel by."""
        begin = 0
        for channel in self.fit[0].case.channels:
            if channel.name == name and self.one.factors.size > 1:
                return float(self.one.factors[begin])
            begin += channel.measured.size
        return float(self.one.factors[0]) if self.one.factors.size == 1 else 1.0

    def _weighted(self, outputs: Signals) -> FloatArray:
        """(N,) all compared outputs in standard deviations of the noise, as the round weighed them."""
        parts = [
            outputs[c.name] * (self._factor(c.name) * np.sqrt(c.weight / c.mean_of) / c.noise)
            for c in self.fit[0].case.channels
        ]
        return np.concatenate(parts)

    def _jacobian(self, ran: _Ran, number: int) -> FloatArray | None:
        """(N, n) of a model's outputs in a profile per scale of each unknown; None if that cannot be simulated."""
        model, fit = self.models[number], self.models[number].fit
        moved = _stepped(fit)
        (signals,) = self._run([ran.profile], [(model, vector) for vector in moved])
        found = np.zeros((ran.outputs[number].size, len(moved)))
        for k, (own, vector) in enumerate(zip(signals, moved, strict=True)):
            taken = (vector[k] - fit.vector[k]) / fit.unknowns.scale[k]
            if own is None or taken == 0.0:
                return None
            found[:, k] = (self._weighted(own) - ran.outputs[number]) / taken
        return found

    def _judged(self, ran: _Ran) -> tuple[list[float], float]:
        """Expected gaps to every rival in a profile, and what the accepted effect does there."""
        jacobians = [self._jacobian(ran, number) for number in range(len(self.models))]
        return self._gaps(ran, jacobians), self._effect(ran, jacobians[0])

    def _gaps(self, ran: _Ran, jacobians: Sequence[FloatArray | None]) -> list[float]:
        """Smallest expected gap between every rival and any other model, whichever of the two is true.

        The one that is not is fitted. That the accepted effect is the true one is what nobody knows yet.
        """
        count = len(self.models)
        gaps = np.full((count, count), np.inf)
        for true, number in permutations(range(count), 2):
            jacobian, information = jacobians[number], self.models[number].fit.information
            difference = ran.outputs[true] - ran.outputs[number]
            gaps[true, number] = 0.0 if jacobian is None else expected_gain(information, jacobian, difference)
        return [float(min(gaps[k].min(), gaps[:, k].min())) for k in range(1, count)]

    def _neutral(self) -> FloatArray:
        """(n,) the accepted model's vector without its effect."""
        model, fit = self.models[0], self.models[0].fit
        own = {p.variable: p.neutral for p in model.candidate.coefficients}
        values = fit.unknowns.named(fit.vector)
        return np.array([own.get(name, values[name]) for name in fit.unknowns.names])

    def _without(self, ran: Sequence[_Ran]) -> list[float]:
        """What the accepted effect does in every profile: squared distance of the outputs without it."""
        runs = self._run([r.profile for r in ran], [(self.models[0], self._neutral())])
        return [
            0.0 if own is None else float(np.sum((r.outputs[0] - self._weighted(own)) ** 2))
            for r, (own,) in zip(ran, runs, strict=True)
        ]

    def _effect(self, ran: _Ran, jacobian: FloatArray | None) -> float:
        """What the accepted effect does in a profile beyond what the declared parameters can imitate."""
        if jacobian is None:
            return 0.0
        model, fit = self.models[0], self.models[0].fit
        own = {p.variable for p in model.candidate.coefficients}
        (signals,) = self._run([ran.profile], [(model, self._neutral())])
        if signals[0] is None:
            return 0.0
        declared = [k for k, u in enumerate(fit.unknowns.members) if u.name not in own and u.declared]
        difference = ran.outputs[0] - self._weighted(signals[0])
        return expected_gain(fit.information[np.ix_(declared, declared)], jacobian[:, declared], difference)

    def _wanted(self, effect: float, ran: _Ran) -> float:
        """The gap that distinguishes a rival from an accepted effect that does ``effect``, as the decision asks for it.

        Beside a model that leaves noise alone, a gap that is to be seen is enough, however it is spread.
        """
        share = max(SIGMAS**2, APART_SHARE * effect)
        if not self._alone_is_noise():
            return share
        samples = ran.inputs.time.size
        seen = max(VISIBLE**2 * samples, SIGNIFICANT * samples**0.5)
        level = sum(self._factor(c.name) ** 2 for c in self.fit[0].case.channels)
        return min(share, max(SIGMAS**2, float(seen * level)))

    def _alone_is_noise(self) -> bool:
        """Whether nothing is to be seen of what the accepted effect leaves in the fit recordings."""
        left = self.models[0].fit.residual / self.one.factors
        return not left.any() or not is_visible(errors(self.fit, left), VISIBLE)

    def _present(self, number: int, samples: int) -> float:
        """Distance to a rival on the fit recordings, scaled to ``samples`` of every output."""
        apart = (self.models[0].fit.residual - self.models[number].fit.residual) / self.one.factors
        recorded = sum(c.measured.size * c.mean_of for c in (t.case.channels[0] for t in self.fit))
        return float(apart @ apart) * samples / recorded

    def _sharpest(self, ran: Sequence[_Ran]) -> SeparatingExperiment | None:
        """The profile that leaves the least certain value of the effect surest."""
        model, fit = self.models[0], self.models[0].fit
        own = [p.variable for p in model.candidate.parameters if p.variable in fit.unknowns.names]
        index = fit.unknowns.index(own)
        best: SeparatingExperiment | None = None
        for one in sorted(ran, key=lambda r: -_moved(r, self))[:SHARPENED]:
            jacobian = self._jacobian(one, 0)
            if jacobian is None:
                continue
            before, after = expected_errors(fit.information, jacobian)
            # Beside its value, or beside the drawing's spread where the value is about zero.
            size = np.maximum(np.abs(fit.vector), 1e-3 * fit.unknowns.scale) / fit.unknowns.scale
            worst = index[int(np.argmax(before[index] / size[index]))]
            name = fit.unknowns.names[worst]
            stated = self.stated.get(name, np.inf)
            if not np.isfinite(stated):
                stated = float(before[worst] * fit.unknowns.scale[worst])
            sharpened = Sharpened(name, stated, stated * float(after[worst] / before[worst]))
            if best is None or best.sharpens is None or sharpened.ratio < best.sharpens.ratio:
                best = SeparatingExperiment(
                    one.profile.name, (model.candidate.name,), 0.0, 0.0, one.inputs,
                    separates=False, reached=one.reached, sharpens=sharpened,
                )  # fmt: skip
        return best


def _menu(spec: DiagnoseSpec, fit: Sequence[Trial]) -> list[tuple[Profile, Signals]]:
    """Every profile of command and load within the limits of the inputs, with all inputs."""
    recorded, limits = [t.case.inputs for t in fit], spec.limits
    assert spec.command is not None
    time = _time(spec, fit)
    found = profiles(
        time,
        input_range(recorded, spec.command, limits.range.get(spec.command), limits.rate.get(spec.command)),
        None
        if spec.load is None
        else input_range(recorded, spec.load, limits.range.get(spec.load), limits.rate.get(spec.load)),
        TRAVEL * travel(recorded, spec.command) if limits.travel is None else limits.travel,
    )
    return [(profile, _inputs(spec, recorded[0], time, profile)) for profile in found]


def _time(spec: DiagnoseSpec, fit: Sequence[Trial]) -> FloatArray:
    step = float(np.median(np.diff(fit[0].case.time)))
    recorded = max(float(t.case.inputs.time[-1] - t.case.inputs.time[0]) for t in fit)
    longest = min(LONGEST, recorded) if spec.limits.time is None else spec.limits.time
    return np.asarray(step * np.arange(int(min(longest, SAMPLES * step) / step + 1e-6) + 1), dtype=np.float64)


def _inputs(spec: DiagnoseSpec, recorded: Signals, time: FloatArray, profile: Profile) -> Signals:
    """The recording's inputs with the profile in place of command and load, the others at their first value."""
    values = {name: np.full(time.size, recorded[name][0]) for name in recorded.names}
    assert spec.command is not None
    values[spec.command] = profile.command
    if spec.load is not None and profile.load is not None:
        values[spec.load] = profile.load
    return Signals(time, values, recorded.units, recorded.held - {spec.command, spec.load})


def _worth(gap: float, wanted: float) -> tuple[bool, float]:
    """Profiles that settle the tie come first, and those with the larger gap."""
    return gap >= SAFETY * wanted, gap


def _moved(ran: _Ran, plan: _Plan) -> float:
    """How much moves in a profile: what excites little teaches little."""
    return float(np.sum(np.diff(ran.outputs[0]) ** 2))


def _stepped(fit: Fit) -> list[FloatArray]:
    """The fitted vector with each unknown moved by some standard errors, off its bounds."""
    errors = np.sqrt(np.diag(np.linalg.pinv(fit.information, hermitian=True)))
    steps = np.clip(STEP * errors, 1e-6, 0.1) * fit.unknowns.scale
    ahead = [fit.unknowns.clip(fit.vector + row) for row in np.diag(steps)]
    back = [fit.unknowns.clip(fit.vector - row) for row in np.diag(steps)]
    return [a if a[k] != fit.vector[k] else b for k, (a, b) in enumerate(zip(ahead, back, strict=True))]


def _distances(ran: _Ran) -> list[float]:
    """Squared distance of the first model's outputs from every other one's, as fitted to the present recordings."""
    return [float(np.sum((ran.outputs[0] - other) ** 2)) for other in ran.outputs[1:]]


def _reached(outputs: Signals) -> dict[str, tuple[float, float]]:
    return {n: (float(outputs[n].min()), float(outputs[n].max())) for n in outputs.names}


def _experiment(trial: Trial, inputs: Signals) -> Experiment:
    return replace(trial.case, inputs=inputs, time=inputs.time).experiment(trial.name, None)
