"""A recording as a simulation that a model has to match: what drives it, and what is compared."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.batch import Experiment, Reducer, Wrapper
from thsa_cosim.costs import window_mask
from thsa_cosim.costs.channels import Channel
from thsa_cosim.errors import ScenarioError
from thsa_cosim.inverse_dynamics import low_pass
from thsa_cosim.recordings import Recording
from thsa_cosim.scenario import ChannelTable, Scenario
from thsa_cosim.signals import FloatArray, Signals


@dataclass(frozen=True, eq=False)
class Case:
    """One recording as a simulation: ``inputs`` drive the FMU over ``time`` (n,) in s.

    ``channels`` are fitted, within the cost's window; ``measured`` holds all samples after the lead-in.
    ``fixed``: start values that every run has, in the FMU's units. ``input_noise``: 1 σ of the white noise that was
    smoothed away, of inputs that are piecewise linear. ``most_steps``: as in `Experiment`.
    """

    name: str
    fmu: Path
    inputs: Signals
    time: FloatArray
    fixed: Mapping[str, float]
    channels: tuple[Channel, ...]
    measured: Signals
    temperature_degC: float | None
    tolerance: float | None
    wrapper: Wrapper | None = None
    texts: Mapping[str, str] = field(default_factory=dict)
    input_noise: Mapping[str, float] = field(default_factory=dict)
    most_steps: int | None = None

    def experiment(self, name: str, reduce: Reducer | None) -> Experiment:
        """The simulation under ``name`` with what the worker makes of its signals."""
        return Experiment(
            name=name,
            fmu=self.fmu,
            inputs=self.inputs,
            outputs=self.measured.names,
            time=self.time,
            fixed=self.fixed,
            tolerance=self.tolerance,
            most_steps=self.most_steps,
            reduce=reduce,
            texts=self.texts,
            wrapper=self.wrapper,
        )


def communication_points(scenario: Scenario, recording: Recording) -> FloatArray:
    """Communication points (n,) s of a recording: its samples, or every ``simulation.step``.

    ScenarioError if the step is longer than the recording.
    """
    time, step = recording.signals.time, scenario.simulation.step
    if step is None:
        return time
    count = int(np.floor((time[-1] - time[0]) / step * (1.0 + 1e-12))) + 1
    if count < 2:
        raise ScenarioError(
            f"{scenario.path}: simulation.step = {step:g} s is longer than {recording.path}; lower it."
        )
    return np.asarray(time[0] + step * np.arange(count))


def build_case(scenario: Scenario, recording: Recording, fixed: Mapping[str, float]) -> Case:
    """A recording as a simulation; ScenarioError if the cost's window leaves no sample of it."""
    time, grid = recording.signals.time, communication_points(scenario, recording)
    counted = _counted(scenario, time) & (time <= grid[-1] + 1e-9 * abs(grid[-1]))
    counted &= time >= recording.compared.time[0]
    if np.count_nonzero(counted) < 2:
        raise ScenarioError(
            f"{scenario.path}: cost.window and cost.mask leave no sample of {recording.name}; widen them."
        )
    channels = tuple(
        _channel(scenario, recording, name, spec, counted) for name, spec in scenario.cost.channels.items()
    )
    return Case(
        name=recording.name,
        fmu=scenario.fmu.path,
        inputs=scenario.drive(recording),
        time=grid,
        fixed={**fixed, **recording.start},
        channels=channels,
        measured=recording.compared.select(scenario.measured),
        temperature_degC=recording.temperature_degC,
        tolerance=scenario.simulation.tolerance,
        texts=scenario.texts,
        input_noise=_smoothed(scenario, recording),
    )


def _smoothed(scenario: Scenario, recording: Recording) -> dict[str, float]:
    """Noise of the inputs that are piecewise linear, and not as measured for a doubt."""
    found = {}
    for name in scenario.inputs:
        column = scenario.table.recordings.columns.get(name)
        asked = column is not None and column.smooth == "piecewise-linear" and name in recording.samples
        if asked and not np.array_equal(recording.samples[name].values, recording.signals[name]):
            noise = (column.noise if column is not None else None) or recording.noise.get(name, 0.0)
            found[name] = float(noise)
    return {name: noise for name, noise in found.items() if noise > 0.0}


def _channel(
    scenario: Scenario, recording: Recording, name: str, spec: ChannelTable, counted: np.ndarray[Any, Any]
) -> Channel:
    """The samples of a channel that count; within a band every so many, so that they do not repeat each other."""
    time, measured, every = recording.signals.time, recording.signals[name], 1
    if spec.band is not None:
        step = float(np.mean(np.diff(time)))
        if 2.0 * spec.band * step >= 1.0:
            raise ScenarioError(
                f"{scenario.path}: cost.channels.{name}.band = {spec.band:g} Hz is above half the sampling rate of"
                f" {recording.name}; lower it or leave it out."
            )
        try:
            measured = low_pass(measured, spec.band, step)
        except ValueError:
            raise ScenarioError(
                f"{scenario.path}: {recording.name} is too short for cost.channels.{name}.band; leave it out."
            ) from None
        every = max(1, int(1.0 / (2.5 * spec.band * step)))
    if name in recording.left_out:
        counted = counted & ~recording.left_out[name]
        if np.count_nonzero(counted) < 2:
            raise ScenarioError(
                f"{scenario.path}: the repairs of {name!r} leave no sample of {recording.name}; leave out fewer."
            )
    return Channel(
        name=name,
        time=time[counted][::every],
        measured=measured[counted][::every],
        noise=scenario.noise(recording, name),
        weight=spec.weight,
        band=spec.band,
    )


def _counted(scenario: Scenario, time: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Which samples (n,) count: inside the window, outside every masked span; s after the first sample."""
    elapsed = time - time[0]
    counted = window_mask(elapsed, scenario.cost.window.start, scenario.cost.window.stop)
    for begin, end in scenario.cost.mask:
        counted &= ~window_mask(elapsed, begin, end)
    return counted
