"""Vectors of unknowns → residuals of the recordings, by batches over a runner."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np
from scipy.ndimage import gaussian_filter1d

from thsa_cosim.batch import Job, Runner, Status
from thsa_cosim.diagnosis.fitting.trials import Part, Trial
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.signals import FloatArray, Signals


class Bench:
    """Runs a model against the recordings; counts what it ran and what failed."""

    def __init__(
        self, runner: Runner, trials: Sequence[Trial], fixed: Mapping[str, float] | None = None
    ) -> None:
        self.trials = tuple(trials)
        self.evaluations = 0
        self.failures: dict[str, int] = {}
        self._runner = runner
        self.notes = tuple(runner.notes)
        self._fixed = dict(fixed or {})
        self.weights: Mapping[str, float] = {}
        """Factors of the channels' residuals, 1 where none is given."""
        self._width = 0.0

    def factors(self, part: Part) -> FloatArray:
        """(N,) what the stacked residuals of ``part`` are multiplied by."""
        return np.concatenate(
            [
                np.full(channel.measured.size, self.weights.get(channel.name, 1.0))
                for trial in self.of(part)
                for channel in trial.case.channels
            ]
        )

    @contextmanager
    def smoothed(self, width: float) -> Iterator[None]:
        """Within it every signal's residuals are smoothed in time by a Gaussian of ``width`` seconds.

        White noise of a standard deviation of 1 keeps it.
        """
        self._width = width
        try:
            yield
        finally:
            self._width = 0.0

    def of(self, part: Part) -> tuple[Trial, ...]:
        """The recordings that play ``part``."""
        return tuple(t for t in self.trials if t.part == part)

    def residuals(self, unknowns: Unknowns, vectors: FloatArray, part: Part) -> list[FloatArray | None]:
        """Per vector (m, n) the stacked residuals (N,) over the recordings of ``part``, None where a run failed.

        Simulated minus measured, in standard deviations of the noise, times the channel's factor.
        """
        trials = self.of(part)
        jobs = [
            Job(t.name, {**self._fixed, **unknowns.assignments(vector, t.group)})
            for vector in vectors
            for t in trials
        ]
        outcomes = self._runner.run(jobs)
        self.evaluations += len(jobs)
        factors = self.factors(part) if self.weights else None
        found: list[FloatArray | None] = []
        for k in range(len(vectors)):
            parts: list[FloatArray] = []
            for outcome in outcomes[k * len(trials) : (k + 1) * len(trials)]:
                if outcome.status == Status.OK and outcome.reduced is not None:
                    parts.append(outcome.reduced)
                else:
                    self.failures[outcome.reason] = self.failures.get(outcome.reason, 0) + 1
            residual = np.concatenate(parts) if len(parts) == len(trials) else None
            if residual is not None and self._width > 0.0:
                residual = self._smooth(trials, residual)
            found.append(residual if residual is None or factors is None else residual * factors)
        return found

    def _smooth(self, trials: Sequence[Trial], residual: FloatArray) -> FloatArray:
        smooth = np.empty_like(residual)
        begin = 0
        for trial in trials:
            for channel in trial.case.channels:
                part = slice(begin, begin := begin + channel.measured.size)
                width = self._width / float(np.median(np.diff(channel.time)))  # samples
                size = np.sqrt(max(1.0, 2.0 * np.sqrt(np.pi) * width))
                smooth[part] = size * gaussian_filter1d(residual[part], width)
        return smooth

    def signals(self, unknowns: Unknowns, vector: FloatArray) -> dict[str, Signals | None]:
        """The simulated outputs of every recording, by experiment name; None where the run failed."""
        jobs = [
            Job(t.name, {**self._fixed, **unknowns.assignments(vector, t.group)}, keep_signals=True)
            for t in self.trials
        ]
        self.evaluations += len(jobs)
        return {t.name: o.signals for t, o in zip(self.trials, self._runner.run(jobs), strict=True)}
