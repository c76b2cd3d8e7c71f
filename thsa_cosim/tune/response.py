"""What a worker makes of one response: its terms, margins among them, as one array."""

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from thsa_cosim.costs.response import RESPONSE_METRICS, response_metrics
from thsa_cosim.fmu import FmuDescription, SimulationFailure
from thsa_cosim.fmu.linear import open_loop, state_names
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.system import open_plant, unpack
from thsa_cosim.system.frequency_response import loop_response
from thsa_cosim.tune.margins import Margins, margins, margins_of
from thsa_cosim.tune.start import start_terms

if TYPE_CHECKING:  # workers import this module
    from thsa_cosim.scenario import TuneScenario
    from thsa_cosim.scenario.metrics_schema import StartTable
    from thsa_cosim.scenario.tune_model import CommandSpec, LoopSpec


@dataclass(frozen=True)
class Terms:
    """Names and positions of a response's terms, in the order of the reducer's array."""

    names: tuple[str, ...]
    peaks: tuple[str, ...]
    effort: str | None
    with_loop: bool

    @classmethod
    def of(cls, scenario: "TuneScenario") -> "Terms":
        """The terms that a scenario asks for."""
        peaks = tuple(dict.fromkeys(r.signal for r in scenario.requirements if r.signal))
        names = ["tracking", *RESPONSE_METRICS]
        names += ["effort"] if scenario.metrics.effort else []
        names += [f"peak.{signal}" for signal in peaks]
        names += scenario.start.terms if scenario.start else ()
        names += ["gain_margin", "phase_margin", "bandwidth"] if scenario.loop else []
        return cls(tuple(names), peaks, scenario.metrics.effort, scenario.loop is not None)


@dataclass(frozen=True, eq=False)
class LoopTask:
    """What linearising needs; ``fixed`` and ``inputs`` as in the simulation, ``tuned`` is recorded with it."""

    fmu: FmuDescription
    fixed: Mapping[str, float]
    inputs: Mapping[str, float]
    command: str
    tuned: tuple[str, ...]
    gains: tuple[str, ...]
    signal: str
    at: float
    reader: str
    texts: Mapping[str, str]

    @property
    def recorded(self) -> tuple[str, ...]:
        """Variables that the simulation must record for it: states and tuned parameters."""
        return (*state_names(self.fmu), *self.tuned)

    def __call__(self, signals: Signals, command: FloatArray) -> Margins:
        """Margins at the state of ``signals`` at ``at``; NaN where the FMU refuses."""
        k = int(np.argmin(np.abs(signals.time - self.at)))
        tuned = {name: float(signals[name][k]) for name in self.tuned}
        try:
            loop = open_loop(
                self.fmu,
                _unpacked(self.fmu),
                values={**self.fixed, **tuned},
                inputs={**self.inputs, self.command: float(command[k])},
                time=float(signals.time[k]),
                states=np.array([signals[name][k] for name in state_names(self.fmu)]),
                signal=self.signal,
                gains=self.gains,
                texts=self.texts,
            )
        except SimulationFailure:
            return Margins(np.nan, np.nan, np.nan)
        return margins(loop, self.reader)


@dataclass(frozen=True, eq=False)
class MeasuredLoop:
    """What measuring the margins of a running system needs; ``fixed`` and ``inputs`` as in the simulation."""

    fmu: FmuDescription
    fixed: Mapping[str, float]
    inputs: Signals
    tuned: tuple[str, ...]
    target: str
    disturbance: str
    at: float
    interval: float
    amplitude: float
    period: float
    tolerance: float | None
    texts: Mapping[str, str]

    @property
    def recorded(self) -> tuple[str, ...]:
        """Variables that the simulation must record for it: tuned parameters."""
        return self.tuned

    def __call__(self, signals: Signals, command: FloatArray) -> Margins:
        """Margins from ``at`` on; NaN where a run fails or the loop does not settle."""
        values = {**self.fixed, **{name: float(signals[name][-1]) for name in self.tuned}}
        try:
            with open_plant(self.fmu, _unpacked(self.fmu)) as plant:
                plant.texts = self.texts
                found = loop_response(
                    plant,
                    values,
                    self.inputs,
                    target=self.target,
                    disturbance=self.disturbance,
                    at=self.at,
                    interval=self.interval,
                    amplitude=self.amplitude,
                    period=self.period,
                    tolerance=self.tolerance,
                )
        except SimulationFailure:
            return Margins(np.nan, np.nan, np.nan)
        return margins_of(found.omega, found.response)


_FOLDERS: dict[str, Path] = {}


def _unpacked(fmu: FmuDescription) -> Path:
    """Folder of the FMU in this process: beside a worker's scratch folder, which goes with the study."""
    if fmu.sha256 not in _FOLDERS:
        here = Path.cwd()
        parent = here.parent if here.name == "cwd" else None
        folder = Path(tempfile.mkdtemp(prefix="linear-", dir=parent))
        unpack(fmu.path, folder)
        _FOLDERS[fmu.sha256] = folder
    return _FOLDERS[fmu.sha256]


@dataclass(frozen=True, eq=False)
class ResponseReducer:
    """Signals of one run → its terms (q,), as :class:`Terms` names them; picklable."""

    terms: Terms
    output: str
    command: FloatArray
    ends_at_most: bool
    begin: float
    factor: float
    scale: float
    fraction: float
    low: float | None
    window: tuple[float, float]
    settling_band: float
    start: "StartTable | None"
    loop: LoopTask | MeasuredLoop | None

    @property
    def recorded(self) -> tuple[str, ...]:
        """Variables that the simulation must record."""
        own = (self.output, *((self.terms.effort,) if self.terms.effort else ()), *self.terms.peaks)
        own = (*own, *(self.start.signals if self.start else ()))
        return tuple(dict.fromkeys((*own, *(self.loop.recorded if self.loop else ()))))

    def __call__(self, signals: Signals) -> FloatArray:
        """Return the terms; velocity errors in units of the cost, times in s, e_ss and overshoot as shares."""
        time, response = signals.time, signals[self.output] * self.factor
        found = list(
            response_metrics(
                time,
                response,
                self.command,
                begin=self.begin,
                window=self.window,
                fraction=self.fraction,
                low=self.low,
                band=self.settling_band,
                scale=self.scale,
                ends_at_most=self.ends_at_most,
            ).values()
        )
        if self.terms.effort is not None:
            found.append(float(np.sqrt(np.mean(signals[self.terms.effort] ** 2))))
        found += [float(np.max(np.abs(signals[name]))) for name in self.terms.peaks]
        if self.start is not None:
            found += start_terms(self.start, signals, self.output, self.begin)
        if self.loop is not None:
            m = self.loop(signals, self.command)
            found += [m.gain_margin, m.phase_margin, m.bandwidth]
        return np.array(found)


def reducer(
    scenario: "TuneScenario", inputs: Signals, fixed: Mapping[str, float], command: "CommandSpec"
) -> ResponseReducer:
    """The reducer of one condition: its ``inputs``, its ``command`` and ``fixed`` start values, in the FMU's units."""
    metrics, loop = scenario.metrics, scenario.loop
    others = [name for name in inputs.names if name != command.input]
    return ResponseReducer(
        terms=Terms.of(scenario),
        output=command.output,
        command=command.values,
        ends_at_most=command.ends_at_most,
        begin=command.begin,
        factor=command.factor,
        scale=scenario.cost.scale,
        fraction=metrics.high if metrics.rise == "between" else metrics.fraction,
        low=metrics.low if metrics.rise == "between" else None,
        window=(metrics.window[0], metrics.window[1]),
        settling_band=metrics.settling_band,
        start=scenario.start,
        loop=None if loop is None else _loop_task(scenario, loop, inputs, fixed, command.input, others),
    )


def _loop_task(
    scenario: "TuneScenario",
    loop: "LoopSpec",
    inputs: Signals,
    fixed: Mapping[str, float],
    command: str,
    others: list[str],
) -> LoopTask | MeasuredLoop:
    fmu = replace(
        scenario.fmu, path=scenario.fmu.path.resolve()
    )  # a worker has a working directory of its own
    tuned = tuple(p.variable for p in scenario.parameters.parameters)
    if loop.disturbance is not None:
        assert loop.amplitude is not None
        assert loop.interval is not None
        return MeasuredLoop(
            fmu,
            fixed,
            inputs,
            tuned,
            loop.signal,
            loop.disturbance,
            loop.at,
            loop.interval,
            loop.amplitude,
            loop.period,
            scenario.simulation.tolerance,
            scenario.texts,
        )
    return LoopTask(
        fmu,
        fixed,
        {name: float(np.interp(loop.at, inputs.time, inputs[name])) for name in others},
        command,
        tuned,
        loop.gains,
        loop.signal,
        loop.at,
        loop.margins,
        scenario.texts,
    )
