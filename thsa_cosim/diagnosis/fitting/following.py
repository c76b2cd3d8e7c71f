"""A model kept in step with the machine: output injection at a place whose speed is measured.

Where a machine sticks and slips, the free run falls out of step at single events, and its least squares have an
optimum for every way to do so. A force against the deviation from the measured speed keeps the model in step, as in an
observer (D. Luenberger, IEEE Transactions on Automatic Control 16 (1971) 596): what is left is an error of prediction
(L. Ljung, System Identification, 2nd edition, section 3.3), which is smooth in the parameters. The force is
proportional to a gain, zero for the free run.

A sensor with a lag shows the speed of a place as well: what it lags by is known from a simulation, and undone. Then the
noise of what is followed is large against that of the sensor, and the signal itself does not count in step: the model
would be bent to follow its noise.
"""

from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Self

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import lfilter

from thsa_cosim.batch import Experiment, Runner
from thsa_cosim.diagnosis.catalogue.slots import INJECTED, Slot
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.structure import rms_by_channel
from thsa_cosim.diagnosis.fitting.trials import Trial, finer
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.signals import FloatArray, Signals

#: A place moves as a signal shows it if the two differ by less than this share of the signal's largest value.
SAME = 1e-6
#: So many neighbouring samples of a measured speed are one that is followed: a solver stops at each.
MEANS = 10
#: Gains are tried in these steps of the place's rms load over its largest speed, ...
STEPS = tuple(float(g) for g in 10.0 ** np.arange(0.0, 4.5, 0.5))
#: ... of which the least counts that leaves no more than this many times what the largest leaves in the signal.
IN_STEP = 1.05
#: A signal is a place's speed behind a lag if that explains it but for this share of its rms.
LAGGED = 0.05
#: A lag longer than this share of a recording shows no speed: a position would be one behind an endless lag.
SLOW = 0.1
#: Gains tried behind a lag, in the same unit, of which the one counts that leaves least: more of it follows the noise.
#: Set while looking at two simulated units with a Stribeck friction that sticks and slips.
LAGGED_STEPS = tuple(float(g) for g in 10.0 ** np.arange(-2.0, 0.5, 0.5))
#: Where the undoing of a lag begins to fade, as a share of half the sampling rate: it amplifies fast noise most.
FADES = 0.85
#: Relative tolerance behind a lag: the measured speed bends at every sample, so steps are short, and nothing is lost
#: against 1e-4 (of one simulated unit every signal's rms was the same to four digits) but a third of the time.
TOLERANCE = 1e-3
#: Factor of the residuals of a signal that does not count: what the model leaves in it stays known.
HARDLY = 1e-3


@dataclass(frozen=True)
class Followed:
    """A place that is to follow the measured ``channel``; ``unit_gain``: its rms load over its largest speed.

    ``lag``: time constant [s] of the first-order sensor that shows its speed.
    """

    slot: Slot
    channel: str
    unit_gain: float
    lag: float = 0.0


class Following:
    """The recordings with the measured speed as a further input of the superset; opens its processes when asked.

    A context manager. ``signals_at``: start values by case → the signals of slots and outputs, by case;
    ``open_runner``: experiments → the processes that run them. ``lagged``: sensors that lag count, too.
    """

    def __init__(
        self,
        bench: Bench,
        slots: Sequence[Slot],
        signals_at: Callable[[Mapping[str, Mapping[str, float]]], Mapping[str, Signals]],
        open_runner: Callable[[Sequence[Experiment]], Runner],
        lagged: bool = False,
    ) -> None:
        self._bench, self._slots = bench, [s for s in slots if s.interface == INJECTED]
        self._signals_at, self._open_runner = signals_at, open_runner
        self._lagged = lagged
        self._of: dict[str, Following] = {}
        self._stack = ExitStack()
        self._opened: tuple[Runner, tuple[Trial, ...]] | None = None
        self._followed: Followed | None = None
        self._asked = False
        self._gain: list[float | None] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def of(self, slot: Slot) -> "Following":
        """The same for one place, whose sensor may lag; closed together with this one."""
        if slot.name not in self._of:
            own = [s for s in self._slots if s.name == slot.name]
            made = Following(self._bench, own, self._signals_at, self._open_runner, lagged=True)
            self._of[slot.name] = self._stack.enter_context(made)
        return self._of[slot.name]

    def followed(self, unknowns: Unknowns, vector: FloatArray) -> Followed | None:
        """The place that can follow a measured speed, if there is one; found at the given vector (n,), once."""
        if self._slots and not self._asked:
            self._asked = True
            trials = self._bench.of("fit")
            values = {t.case.name: unknowns.assignments(vector, t.group) for t in trials}
            self._followed = find_followed(self._slots, trials, self._signals_at(values), self._lagged)
        return self._followed

    def at(self, gain: float) -> Bench:
        """The bench of the model that follows with a ``gain``; the followed place must be known."""
        assert self._followed is not None
        if self._opened is None:
            trials = tuple(driven(t, self._followed) for t in self._bench.trials)
            runner = self._stack.enter_context(self._open_runner([t.experiment for t in trials]))
            self._opened = runner, trials
        return self._bench.beside(*self._opened, {self._followed.slot.gain: gain})

    def beside_signal(self, gain: float) -> Bench:
        """The same, the followed signal hardly counted: a model is not bent to follow its noise."""
        made = self.at(gain)
        assert self._followed is not None
        made.weights = {**made.weights, self._followed.channel: HARDLY}
        return made

    def finer(self, tolerance: float) -> Bench:
        """The bench of the free run at a smaller relative ``tolerance``; itself where it has that."""
        trials = finer(self._bench.trials, tolerance)
        if trials == self._bench.trials:
            return self._bench
        runner = self._stack.enter_context(self._open_runner([t.experiment for t in trials]))
        return self._bench.beside(runner, trials, {})

    def gain(self, unknowns: Unknowns, vector: FloatArray) -> float | None:
        """The least gain by which the model follows as well as it can; found at the given vector (n,), once.

        Behind a lag the one that leaves least in the other signals. None where no place can follow.
        """
        if not self._gain:
            followed = self.followed(unknowns, vector)
            self._gain.append(None if followed is None else self._least(followed, unknowns, vector))
        return self._gain[0]

    def _least(self, followed: Followed, unknowns: Unknowns, vector: FloatArray) -> float | None:
        """The more gain, the closer it follows: the least is found by bisection."""
        if followed.lag:
            tried = [step * followed.unit_gain for step in LAGGED_STEPS]
            left = [self._beside(gain, unknowns, vector) for gain in tried]
            least = int(np.argmin(left))
            return tried[least] if np.isfinite(left[least]) else None
        gains = [step * followed.unit_gain for step in STEPS]
        best = self._left(followed, gains[-1], unknowns, vector)
        if not np.isfinite(best):
            return None
        near = bisect_left(
            gains[:-1],
            True,
            key=lambda gain: self._left(followed, gain, unknowns, vector) <= IN_STEP * best,
        )
        return gains[near]

    def _beside(self, gain: float, unknowns: Unknowns, vector: FloatArray) -> float:
        """Sum of squares that the model in step leaves in the signals that it does not follow; inf if it fails."""
        (residual,) = self.beside_signal(gain).residuals(unknowns, vector[None, :], "fit")
        return np.inf if residual is None else float(residual @ residual)

    def _left(self, followed: Followed, gain: float, unknowns: Unknowns, vector: FloatArray) -> float:
        """The rms of what the model leaves in the signal that it follows, in standard deviations; inf if it fails."""
        bench = self.at(gain)
        (residual,) = bench.residuals(unknowns, vector[None, :], "fit")
        if residual is None:
            return np.inf
        return rms_by_channel(bench.of("fit"), residual / bench.factors("fit"))[followed.channel]


def find_followed(
    slots: Sequence[Slot], trials: Sequence[Trial], signals: Mapping[str, Signals], lagged: bool = False
) -> Followed | None:
    """The first place whose speed a compared signal shows, ``lagged``: by itself or behind a lag of first order.

    ``signals``: simulated ones of slots and outputs, by case.
    """
    runs = [run for t in trials if (run := signals.get(t.case.name)) is not None]
    for slot in (s for s in slots if s.interface == INJECTED and runs):
        speeds = [run[f"{slot.component}.v"] for run in runs]
        largest = max(float(np.max(np.abs(speed))) for speed in speeds)
        load = float(np.sqrt(np.mean(np.concatenate([run[f"{slot.component}.N"] for run in runs]) ** 2)))
        channels = [c.name for c in trials[0].case.channels if load > 0.0]
        for channel in channels:
            apart = max(float(np.max(np.abs(v - run[channel]))) for v, run in zip(speeds, runs, strict=True))
            if apart < SAME * largest:
                return Followed(slot, channel, load / largest)
        for channel in channels if lagged else ():
            lag = _lag([(run.time, v, run[channel]) for v, run in zip(speeds, runs, strict=True)])
            if lag is not None:
                return Followed(slot, channel, load / largest, lag)
    return None


def _lag(runs: Sequence[tuple[FloatArray, FloatArray, FloatArray]]) -> float | None:
    """Time constant T [s] of y' = (v - y) / T, of runs (time, v, y); None if that does not explain y."""
    integrals = [np.asarray(cumulative_trapezoid(v - y, time, initial=0), float) for time, v, y in runs]
    total, moved = np.concatenate(integrals), np.concatenate([y - y[0] for _, _, y in runs])
    squares = float(moved @ moved)
    if not squares or float(moved @ total) <= 0.0:
        return None
    lag = float(total @ total) / float(moved @ total)
    if lag > SLOW * max(float(time[-1] - time[0]) for time, _, _ in runs):
        return None
    # Judged by what a lag shows, not by its integral: that adds up what happens between samples where a place sticks.
    off = sum(float(np.sum((with_lag(time, v, lag, y[0]) - y) ** 2)) for time, v, y in runs)
    return lag if off < LAGGED**2 * squares else None


def with_lag(time: FloatArray, shown: FloatArray, lag: float, first: float) -> FloatArray:
    """(n,) what a sensor of first order with time constant ``lag`` [s] shows of ``shown`` (n,), linear in between.

    ``time`` (n,) s, evenly spaced; it begins at ``first``.
    """
    step = float(time[-1] - time[0]) / (time.size - 1)
    decay = np.exp(-step / lag)
    rise = (1.0 - decay) * lag / step
    forced = (1.0 - rise) * shown[1:] + (rise - decay) * shown[:-1]
    after, _ = lfilter([1.0], [1.0, -decay], forced, zi=[decay * first])
    return np.concatenate([[first], after])


def without_lag(time: FloatArray, shown: FloatArray, lag: float, mean_of: int, at: FloatArray) -> FloatArray:
    """What a sensor of first order with time constant ``lag`` [s] was shown, at the times ``at``, linear in between.

    ``time``, ``shown`` (N,): what it shows; means of ``mean_of`` samples. Up to FADES of half the sampling rate.
    """
    step = float(time[-1] - time[0]) / (time.size - 1)
    even = np.interp(time[0] + step * np.arange(time.size), time, shown)
    spectrum = np.fft.rfft(np.concatenate([even, even[::-1]]))  # mirrored: no jump at its ends
    f = np.fft.rfftfreq(2 * time.size, step)
    undone = (1.0 + 2j * np.pi * lag * f) / np.sinc(f * np.median(np.diff(at))) ** 2
    if mean_of > 1:
        undone /= np.sinc(f * step)
    begin, end = FADES * f[-1], f[-1]
    undone *= np.where(f < begin, 1.0, 0.5 + 0.5 * np.cos(np.pi * (f - begin) / (end - begin)))
    fine = max(1, round(step / float(np.median(np.diff(at)))))
    count = 2 * time.size * fine
    values = np.fft.irfft(spectrum * undone, count)[: time.size * fine] * fine
    return np.interp(at, time[0] + step / fine * np.arange(values.size), values)


def driven(trial: Trial, followed: Followed) -> Trial:
    """The recording with the measured speed as a further input: means of neighbouring samples, or without its lag."""
    case = trial.case
    channel = next(c for c in case.channels if c.name == followed.channel)
    time, speed = channel.time, channel.measured
    if followed.lag:
        case = replace(case, tolerance=max(case.tolerance or 0.0, TOLERANCE))
        given = without_lag(time, speed, followed.lag, channel.mean_of, case.inputs.time)
    else:
        of = max(1, MEANS // channel.mean_of)
        count = time.size // of
        if count > 1:
            time, speed = (x[: count * of].reshape(count, of).mean(axis=1) for x in (time, speed))
        given = np.interp(case.inputs.time, time, speed)
    values = {**case.inputs.values, followed.slot.measured: given}
    return replace(trial, case=replace(case, inputs=replace(case.inputs, values=values)))
