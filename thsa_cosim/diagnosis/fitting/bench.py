"""Vectors of unknowns → residuals of the recordings, by batches over an engine."""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from thsa_cosim.batch import Job, Outcome, Runner
from thsa_cosim.diagnosis.fitting.trials import Part, Trial
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study import Engine, Reply, Request, Want


@dataclass(frozen=True, eq=False)
class Fitted:
    """Unknowns that are fitted to trials; a problem of the engine, whose vectors are in the unknowns' units.

    ``fixed``: start values of every simulation.
    """

    trials: tuple[Trial, ...]
    unknowns: Unknowns
    fixed: Mapping[str, float]
    label: str = "fit"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return self.unknowns.names

    @property
    def size(self) -> int:
        """Number of recordings."""
        return len(self.trials)

    @property
    def samples(self) -> int:
        """Number of residuals N."""
        return sum(channel.measured.size for trial in self.trials for channel in trial.case.channels)

    def decode(self, vectors: FloatArray) -> FloatArray:
        """Values as they are."""
        return vectors

    def jobs(
        self, want: Want, values: Sequence[Mapping[str, float]], overrides: Mapping[str, float]
    ) -> list[Job]:
        """One simulation per recording."""
        keep = want is Want.SIGNALS
        jobs = []
        for trial, own in zip(self.trials, values, strict=True):
            assigned = self.unknowns.assignments(np.array(list(own.values())), trial.group)
            jobs.append(Job(trial.name, {**self.fixed, **assigned, **overrides}, keep_signals=keep))
        return jobs

    def judge(self, want: Want, outcomes: Sequence[Outcome]) -> tuple[float, FloatArray]:
        """Sum of squared residuals, for the progress; infinite if a simulation failed. It has no terms."""
        squares = [float(o.reduced @ o.reduced) for o in outcomes if o.ok and o.reduced is not None]
        return sum(squares) if len(squares) == len(outcomes) else np.inf, np.zeros(0)


#: Bytes of residuals that one batch of simulations returns: beside them there is at most one copy.
AT_ONCE = 2**26


class Bench:
    """Runs a model against the recordings; counts what it ran and what failed."""

    def __init__(
        self, runner: Runner, trials: Sequence[Trial], fixed: Mapping[str, float] | None = None
    ) -> None:
        self.trials = tuple(trials)
        self.failures: dict[str, int] = {}
        """Failed simulations by reason, in the order in which the reasons came up."""
        self._engine = Engine(runner)
        self.notes = tuple(runner.notes)
        self._fixed = dict(fixed or {})
        self.weights: Mapping[str, float] = {}
        """Factors of the channels' residuals, 1 where none is given."""
        self._beside: list[Bench] = []
        self._before = 0

    @property
    def evaluations(self) -> int:
        """Simulations so far, those of the benches `beside` it included."""
        return self._before + self._engine.runs + sum(bench.evaluations for bench in self._beside)

    def beside(self, runner: Runner, trials: Sequence[Trial], fixed: Mapping[str, float]) -> "Bench":
        """The same recordings driven otherwise, as ``trials``, with further ``fixed`` start values; weighed alike."""
        made = Bench(runner, trials, {**self._fixed, **fixed})
        made.failures, made.weights = self.failures, self.weights
        self._beside.append(made)
        return made

    def alone(self, trial: Trial) -> "Bench":
        """The same with one ``trial`` of its own only; its runs count with this one's."""
        made = copy(self)
        made.trials, made._beside = (trial,), []
        return made

    def go_over(self, other: "Bench") -> None:
        """Simulate from here on as ``other`` does, one `beside` this."""
        if other is not self:
            self._beside.remove(other)
            self._before += self._engine.runs
            self._engine, self.trials, self._fixed = other._engine, other.trials, other._fixed

    def factors(self, part: Part) -> FloatArray:
        """(N,) what the stacked residuals of ``part`` are multiplied by."""
        return np.concatenate(
            [
                np.full(channel.measured.size, self.weights.get(channel.name, 1.0))
                for trial in self.of(part)
                for channel in trial.case.channels
            ]
        )

    def level(self, part: Part) -> float:
        """Root mean square of the `factors` of ``part``: what white noise of the sensors' size would leave."""
        return float(np.sqrt(np.mean(self.factors(part) ** 2))) if self.weights else 1.0

    def of(self, part: Part) -> tuple[Trial, ...]:
        """The recordings that play ``part``."""
        return tuple(t for t in self.trials if t.part == part)

    def residuals(self, unknowns: Unknowns, vectors: FloatArray, part: Part) -> list[FloatArray | None]:
        """Per vector (m, n) the stacked residuals (N,) over the recordings of ``part``, None where a run failed.

        Simulated minus measured, in standard deviations of the noise, times the channel's factor.
        """
        trials = self.of(part)
        factors = self.factors(part) if self.weights else None
        samples = sum(channel.measured.size for trial in trials for channel in trial.case.channels)
        count = max(1, AT_ONCE // (8 * samples))
        found: list[FloatArray | None] = []
        for first in range(0, len(vectors), count):
            reply = self._ask(Want.RESIDUALS, trials, unknowns, vectors[first : first + count])
            found += [r if r is None or factors is None else r * factors for r in reply.residuals]
        return found

    def signals(self, unknowns: Unknowns, vector: FloatArray) -> dict[str, Signals | None]:
        """The simulated outputs of every recording, by experiment name; None where the run failed."""
        reply = self._ask(Want.SIGNALS, self.trials, unknowns, vector[None, :])
        return {t.name: o.signals for t, o in zip(self.trials, reply.outcomes[0], strict=True)}

    def _ask(self, want: Want, trials: tuple[Trial, ...], unknowns: Unknowns, vectors: FloatArray) -> Reply:
        reply = self._engine.ask(Fitted(trials, unknowns, self._fixed), Request(want, vectors))
        for outcome in (o for own in reply.outcomes for o in own if not o.ok):
            self.failures[outcome.reason] = self.failures.get(outcome.reason, 0) + 1
        return reply
