"""How inputs reach a Co-Simulation FMU, found by trial: hold, mean, derivatives, intermediate update, Model Exchange.

What an FMU declares promises nothing. Each way that it offers is run on the same excitation, at the communication
step and at half of it, and compared with the most exact run at hand: Model Exchange at a tight tolerance where the
FMU offers it, an eighth of the step otherwise. A way is consistent if half the step brings it nearer.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from thsa_cosim.batch.job import Experiment, Job
from thsa_cosim.batch.local import LocalRunner
from thsa_cosim.batch.own_step import moves_within, own_step
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.fmu.inputs import input_modes, input_variables, is_linear
from thsa_cosim.fmu.plant import Kind
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.system import read_description

REFERENCE_TOLERANCES = (1e-8, 1e-6)
"""The second one for FMUs whose derivatives are too noisy for the first."""
GOOD = 2e-3
"""An error in Co-Simulation above which Model Exchange is the better interface, if it is offered."""
_NEARER = 0.75
_NOISE = 1e-6
"""Errors below this are the solver's."""
_FLOOR = 1e-9
"""Ranges count as at least this share of a signal's size."""


@dataclass(frozen=True)
class Way:
    """One way to give inputs, and how far off it was."""

    mode: str
    error: float
    """Largest deviation from the reference over all outputs, relative to each one's range; inf if it failed."""
    halved: float
    """The same with half the communication step."""
    worst: str
    """The output that deviates most."""
    reason: str = ""
    """Why it failed."""

    @property
    def is_consistent(self) -> bool:
        """Whether half the step brings it nearer to the reference."""
        return self.halved <= max(_NEARER * self.error, _NOISE)


@dataclass(frozen=True)
class HandlingTrial:
    """What was found."""

    reference: str
    ways: tuple[Way, ...]
    exchange_confirmed: bool
    """Whether Model Exchange is offered, runs, and Co-Simulation comes nearer to it with half the step."""
    shortcoming: str = ""
    """Why nothing could be compared."""

    @property
    def best(self) -> Way | None:
        """The consistent way with the smallest error, or the nearest of all if none is consistent."""
        worked = [way for way in self.ways if np.isfinite(way.error)]
        floor = 2.0 * min((way.halved for way in worked), default=0.0)
        good = [way for way in worked if way.is_consistent or way.halved <= floor]
        return min(good or worked, key=lambda way: max(way.error, _NOISE), default=None)

    @property
    def kind(self) -> Kind:
        """The interface to use."""
        best = self.best
        poor = best is None or best.error > GOOD
        return "model-exchange" if poor and self.exchange_confirmed else "co-simulation"

    def sentence(self) -> str:
        """Say what is used and why, with figures."""
        best = self.best
        if best is None:
            return self.shortcoming or "no way to give inputs works"
        figures = ", ".join(
            f"{_NAMES[way.mode]} {way.error:.1e}" if np.isfinite(way.error) else f"{_NAMES[way.mode]} fails"
            for way in self.ways
        )
        used = "Model Exchange" if self.kind == "model-exchange" else _NAMES[best.mode]
        return f"{used} (largest error over range against {self.reference}: {figures}; {best.worst})"


_NAMES = {
    "hold": "held at the begin of a step",
    "mean": "held at the mean of a step",
    "derivative": "input derivatives",
    "intermediate": "intermediate update",
}


def try_input_handling(
    experiment: Experiment, *, deadline_s: float | None = 60.0, **limits: int
) -> HandlingTrial:
    """Compare the ways to give an FMU the inputs of ``experiment``; ``limits``: further options of ``LocalRunner``.

    Raises
    ------
    FmuError, ParameterError
        If the experiment does not fit its FMU.
    """
    options: dict[str, Any] = {"deadline_s": deadline_s, **limits}
    description = read_description(experiment.fmu)
    modes = _modes(description, experiment.inputs)
    plain = replace(experiment, reduce=None, wrapper=None, input_mode=None)
    grids = {"h": experiment.time, "h/2": refined(experiment.time, 2)}
    trials = [
        replace(plain, name=f"{mode} {name}", time=time, input_mode=mode)
        for mode in modes
        for name, time in grids.items()
    ]
    reference, source = None, ""
    if description.supports_model_exchange and description.fmi_version != "1.0":
        exact = [replace(plain, name=f"{t:g}", tolerance=t) for t in REFERENCE_TOLERANCES]
        with LocalRunner(exact, kind="model-exchange", **options) as runner:
            for one in exact:
                (outcome,) = runner.run([Job(one.name)])
                if outcome.ok and outcome.signals is not None:
                    reference, source = dict(outcome.signals.values), "Model Exchange"
                    break
    fine = replace(plain, name="fine", time=refined(experiment.time, 8), input_mode="mean")
    if not description.supports_co_simulation:
        return HandlingTrial(source, (), reference is not None, "it offers Model Exchange only")
    with LocalRunner([*trials, fine], kind="co-simulation", **options) as runner:
        if reference is None:
            (outcome,) = runner.run([Job("fine")])
            if not outcome.ok or outcome.signals is None:
                reason = f"an eighth of the step fails: {outcome.reason}"
                return HandlingTrial("", (), False, reason)
            step = float(np.median(np.diff(experiment.time)))
            own = own_step(outcome.signals.time, outcome.signals.values)
            if own is not None and own > _OWN * step and moves_within(description, experiment.inputs):
                return HandlingTrial("", (), False, _by_itself(own, step))
            reference = {n: v[::8] for n, v in outcome.signals.values.items()}
            source = "an eighth of the step"
        outcomes = runner.run([Job(trial.name) for trial in trials])
    ways = []
    for i, mode in enumerate(modes):
        coarse, half = outcomes[2 * i], outcomes[2 * i + 1]
        reason = coarse.reason or half.reason
        if reason or coarse.signals is None or half.signals is None:
            ways.append(Way(mode, np.inf, np.inf, "", reason))
            continue
        error, worst = largest_change(reference, coarse.signals.values, jumps=True)
        at_points = {n: v[::2] for n, v in half.signals.values.items()}
        halved, _ = largest_change(reference, at_points, jumps=True)
        ways.append(Way(mode, error, halved, worst))
    confirmed = source == "Model Exchange" and (
        not any(np.isfinite(w.error) for w in ways) or any(w.is_consistent for w in ways)
    )
    return HandlingTrial(source, tuple(ways), confirmed)


_OWN = 0.4
"""Share of the communication step from which on an FMU's own step spoils a comparison with an eighth of it."""


def _by_itself(own: float, step: float) -> str:
    said = f"it steps by itself, every {own:.3g} s: communicating more often than that tells nothing"
    longer = f", and shows values up to {own:.3g} s early; set simulation.step = {own:.3g}"
    return said + (longer if own > 1.5 * step else "")


def _modes(description: FmuDescription, inputs: Signals | None) -> tuple[str, ...]:
    linear = [v for v in input_variables(description, inputs) if is_linear(inputs, v)]
    return input_modes(description, linear) if linear else ("mean",)


def refined(time: FloatArray, parts: int) -> FloatArray:
    """Return ``time`` (n,) with every step divided into ``parts`` equal ones."""
    shares = np.arange(parts) / parts
    fine = (time[:-1, None] + np.diff(time)[:, None] * shares).ravel()
    return np.append(fine, time[-1])


def largest_change(
    reference: Mapping[str, FloatArray],
    found: Mapping[str, FloatArray],
    names: Sequence[str] | None = None,
    *,
    jumps: bool = False,
) -> tuple[float, str]:
    """Return the largest deviation over all signals, relative to each one's range, and whose it is.

    A range counts as at least 1e-9 of the signal's size, and of 1e-9 of the largest signal of its kind: a signal that
    is zero but for rounding is no reason for alarm. ``jumps``: a signal may jump a little earlier or later, as events
    do that fall between communication points, and one that switches all the time is compared by its integral.
    """
    changes = {}
    for name in names or reference:
        deviation = np.abs(found[name] - reference[name])
        size = float(np.max(np.abs(reference[name])))
        scale = max(float(np.ptp(reference[name])), _FLOOR * size, _TINY)
        if jumps and float(np.max(deviation)) > _JUMP * scale:
            deviation = _beside_jumps(reference[name], found[name], deviation, scale)
        difference = float(np.max(deviation))
        changes[name] = difference / scale if difference > _FLOOR * size + _TINY else 0.0
    worst = max(changes, key=lambda name: changes[name])
    return changes[worst], worst


def said(change: float, name: str) -> str:
    """A change of ``largest_change`` in words."""
    if change > _CONSTANT:
        return f"moves {name}, which is constant otherwise"
    return f"changes {name} by {change:.1e} of its range"


_CONSTANT = 1e6
_JUMP = 0.1
"""Share of its range that a signal jumps by between two samples."""
_SWITCHING = 0.1
"""Share of samples with a jump from which on a signal switches all the time."""
_SHIFT = 0.003
"""Share of all samples that a jump may come earlier or later; a sample at least."""


def _beside_jumps(
    reference: FloatArray, found: FloatArray, deviation: FloatArray, scale: float
) -> FloatArray:
    """The deviation (n,); near a jump that from the nearest sample around; of a signal that switches its mean's."""
    jumps = np.abs(np.diff(reference)) > _JUMP * scale
    if np.mean(jumps) > _SWITCHING:
        together = np.cumsum(reference - reference[0])
        return np.asarray(np.abs(np.cumsum(found - reference)) * scale / max(float(np.ptp(together)), _TINY))
    reach = max(1, round(_SHIFT * reference.size))
    near = np.zeros(reference.size, dtype=bool)
    for k in np.flatnonzero(jumps).tolist():
        near[max(k - reach + 1, 0) : k + reach + 1] = True
    around = sliding_window_view(np.pad(reference, reach, mode="edge"), 2 * reach + 1)
    nearest = np.abs(around - found[:, None]).min(axis=1)
    return np.asarray(np.where(near, nearest, deviation))


_TINY = 1e-12
"""A signal in SI units that stays below this is zero: rounding of larger ones."""
