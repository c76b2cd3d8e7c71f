"""A model kept in step with the machine: output injection at a place whose speed is measured.

Where a machine sticks and slips, the free run falls out of step at single events, and its least squares have an
optimum for every way to do so. A force against the deviation from the measured speed keeps the model in step, as in an
observer (D. Luenberger, IEEE Transactions on Automatic Control 16 (1971) 596): what is left is an error of prediction
(L. Ljung, System Identification, 2nd edition, section 3.3), which is smooth in the parameters. The force is
proportional to a gain, zero for the free run.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Self

import numpy as np

from thsa_cosim.batch import Experiment, Runner
from thsa_cosim.diagnosis.catalogue.slots import INJECTED, Slot
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.structure import split
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.signals import FloatArray, Signals

#: A place moves as a signal shows it if the two differ by less than this share of the signal's largest value.
SAME = 1e-6
#: So many neighbouring samples of a measured speed are one that is followed: a solver stops at each.
MEANS = 5
#: Gains are tried in these steps of the place's rms load over its largest speed, ...
STEPS = tuple(float(g) for g in 10.0 ** np.arange(0.0, 4.5, 0.5))
#: ... until the model leaves this many times the noise in the signal that it follows.
IN_STEP = 1.0


@dataclass(frozen=True)
class Followed:
    """A place that is to follow the measured ``channel``; ``unit_gain``: its rms load over its largest speed."""

    slot: Slot
    channel: str
    unit_gain: float


class Following:
    """The recordings with the measured speed as a further input of the superset; opens its processes when asked.

    A context manager. ``signals_at``: start values by case → the slots' signals, by case; ``open_runner``: experiments
    → the processes that run them.
    """

    def __init__(
        self,
        bench: Bench,
        slots: Sequence[Slot],
        signals_at: Callable[[Mapping[str, Mapping[str, float]]], Mapping[str, Signals]],
        open_runner: Callable[[Sequence[Experiment]], Runner],
    ) -> None:
        self._bench, self._slots = bench, slots
        self._signals_at, self._open_runner = signals_at, open_runner
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

    def followed(self, unknowns: Unknowns, vector: FloatArray) -> Followed | None:
        """The place that can follow a measured speed, if there is one; found at the given vector (n,), once."""
        if not self._asked:
            self._asked = True
            trials = self._bench.of("fit")
            values = {t.case.name: unknowns.assignments(vector, t.group) for t in trials}
            places = self._signals_at(values)
            outputs = self._bench.signals(unknowns, vector)
            shown = {t.case.name: s for t in trials if (s := outputs[t.name]) is not None}
            self._followed = find_followed(self._slots, trials, places, shown)
        return self._followed

    def at(self, gain: float) -> Bench:
        """The bench of the model that follows with a ``gain``; the followed place must be known."""
        assert self._followed is not None
        if self._opened is None:
            trials = tuple(driven(t, self._followed) for t in self._bench.trials)
            runner = self._stack.enter_context(self._open_runner([t.experiment for t in trials]))
            self._opened = runner, trials
        return self._bench.beside(*self._opened, {self._followed.slot.gain: gain})

    def gain(self, unknowns: Unknowns, vector: FloatArray) -> float | None:
        """The least gain by which the model follows within the noise; found at the given vector (n,), once.

        None where no place can follow, or none does.
        """
        if not self._gain:
            self._gain.append(self._least_gain(unknowns, vector))
        return self._gain[0]

    def _least_gain(self, unknowns: Unknowns, vector: FloatArray) -> float | None:
        followed = self.followed(unknowns, vector)
        if followed is None:
            return None
        for step in STEPS:
            bench = self.at(step * followed.unit_gain)
            (residual,) = bench.residuals(unknowns, vector[None, :], "fit")
            if residual is None:
                continue
            parts = split(bench.of("fit"), residual / bench.factors("fit"))[followed.channel]
            if float(np.mean(np.concatenate(parts) ** 2)) < IN_STEP**2:
                return step * followed.unit_gain
        return None


def find_followed(
    slots: Sequence[Slot],
    trials: Sequence[Trial],
    places: Mapping[str, Signals],
    outputs: Mapping[str, Signals],
) -> Followed | None:
    """The first place whose speed a compared signal shows, by simulations of the slots and of the outputs, by case."""
    common = [t for t in trials if t.case.name in places and t.case.name in outputs]
    for slot in (s for s in slots if s.interface == INJECTED):
        for channel in (c.name for c in trials[0].case.channels):
            speeds = [places[t.case.name][f"{slot.component}.v"] for t in common]
            shown = [outputs[t.case.name][channel] for t in common]
            apart = [float(np.max(np.abs(a - b))) for a, b in zip(speeds, shown, strict=True)]
            largest = max((float(np.max(np.abs(b))) for b in shown), default=0.0)
            if common and largest > 0.0 and max(apart) < SAME * largest:
                loads = np.concatenate([places[t.case.name][f"{slot.component}.N"] for t in common])
                load = float(np.sqrt(np.mean(loads**2)))
                return Followed(slot, channel, load / largest) if load > 0.0 else None
    return None


def driven(trial: Trial, followed: Followed) -> Trial:
    """The recording with the measured speed as a further input, by means of neighbouring samples."""
    case = trial.case
    channel = next(c for c in case.channels if c.name == followed.channel)
    time, speed = channel.time, channel.measured
    count = time.size // MEANS
    if count > 1:
        time, speed = (x[: count * MEANS].reshape(count, MEANS).mean(axis=1) for x in (time, speed))
    values = {**case.inputs.values, followed.slot.measured: np.interp(case.inputs.time, time, speed)}
    return replace(trial, case=replace(case, inputs=replace(case.inputs, values=values)))
