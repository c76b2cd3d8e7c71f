"""Simulate once per recording and compare: what ``thsa-cosim simulate`` does."""

import csv
import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim import __version__
from thsa_cosim.batch import Experiment, Job, Outcome
from thsa_cosim.errors import StudyError
from thsa_cosim.inspection import Inspection, Residual, Trust, judge, misfits
from thsa_cosim.recordings import Recording
from thsa_cosim.scenario import Scenario
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study import (
    ChannelError,
    CouplingError,
    Engine,
    Place,
    Progress,
    Request,
    Study,
    Want,
    communication_points,
    compare,
    coupling_error,
    describe,
    study_identity,
)

RESULT = "result.json"


@dataclass(frozen=True, eq=False)
class SimulatedRecording:
    """One recording, simulated; ``simulated`` is None and ``reason`` says why if that failed."""

    name: str
    role: str
    """"fit" or "validate": where the scenario names the recording."""
    temperature_degC: float | None
    measured: Signals
    """All recorded channels at the recording's samples."""
    simulated: Signals | None
    """The FMU's outputs at the communication points, in its units."""
    errors: Mapping[str, ChannelError]
    status: str
    reason: str
    duration_s: float
    console: str


@dataclass(frozen=True, eq=False)
class SimulateResult:
    """What ``simulate`` found."""

    scenario: Scenario
    recordings: tuple[SimulatedRecording, ...]
    failures: Mapping[str, int]
    """reason -> number of recordings"""
    files: tuple[Path, ...]
    notes: tuple[str, ...] = ()
    coupling: CouplingError | None = None
    """What the steps of a system's components cost on the first recording; None where nothing is coupled by steps."""

    @cached_property
    def data(self) -> Inspection:
        """What is wrong with the recordings, and which slip of a signal explains what the model leaves of them."""
        found = self.scenario.data
        known = {(f.recording, f.channel, f.kind) for f in found.findings}
        slips = [
            f
            for r in self.recordings
            for f in misfits(_residuals(self.scenario, r), self.scenario.file_units)
        ]
        slips = [f for f in slips if (f.recording, f.channel, f.kind) not in known]
        return Inspection.of((*found.findings, *slips), found.repairs)

    @property
    def trust(self) -> Trust:
        """Whether the model leaves nothing but noise of the fit recordings (of all, without any)."""
        fit = [r for r in self.recordings if r.role == "fit"] or self.recordings
        known = [self.coupling.reason] if self.coupling is not None and self.coupling.reason else []
        return judge([residual for r in fit for residual in _residuals(self.scenario, r)], known)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of result.json: plain JSON types."""
        return {
            "kind": "simulate",
            "status": "complete",
            "title": self.scenario.title,
            "seed": self.scenario.seed,
            "evaluations": len(self.recordings),
            "failures": dict(self.failures),
            "fmu": {"path": str(self.scenario.fmu.path), "sha256": self.scenario.fmu.sha256},
            "version": __version__,
            "data": self.data.to_dict(),
            "trust": self.trust.to_dict(),
            "notes": list(self.notes),
            **({} if self.coupling is None else {"coupling": self.coupling.to_dict()}),
            "recordings": [
                {
                    "name": r.name,
                    "role": r.role,
                    "temperature_degC": r.temperature_degC,
                    "status": r.status,
                    "reason": r.reason,
                    "duration_s": r.duration_s,
                    "error": {
                        channel: {
                            "rmse": e.rmse,
                            "nrmse": e.nrmse if np.isfinite(e.nrmse) else None,
                            "noise": e.noise,
                            "unit": e.unit,
                        }
                        for channel, e in r.errors.items()
                    },
                }
                for r in self.recordings
            ],
        }


def simulate(scenario: Scenario, place: Place) -> SimulateResult:
    """Run every recording of ``scenario`` once; write result.json and one CSV per recording to the study folder.

    Parameters that the scenario would identify take their start values (without: the middle of their bounds).
    A recording whose simulation fails is part of the result, with its reason.

    Raises
    ------
    InputError
        If the scenario and its recordings do not fit together, or the folder holds another study.
    StudyError
        If every simulation failed.
    """
    recordings = _Recordings(tuple(_cases(scenario)))
    told = 0

    def count(progress: Progress) -> None:
        nonlocal told
        if progress.runs > told:
            told = progress.runs
            place.say(f"{told} of {recordings.size} recordings simulated")

    experiments = [experiment for *_, experiment in recordings.cases]
    useful = min(place.executor.workers, max(len(experiments), 1))
    place = replace(place, executor=replace(place.executor, workers=useful))
    with Study.open(place, study_identity(scenario, "simulate"), describe(scenario)) as study:
        with study.open_runner(scenario.simulation, experiments) as runner:
            request = Request(Want.SIGNALS, np.zeros((1, 0)))
            (outcomes,) = Engine(runner, on_progress=count).ask(recordings, request).outcomes
            notes = (*scenario.notes, *runner.notes)
        coupled = _coupling(scenario, recordings.cases, outcomes)
        result = _written(place.folder, scenario, recordings.cases, outcomes, notes, coupled)
        study.complete()
    return result


@dataclass(frozen=True, eq=False)
class _Recordings:
    """Every recording with its role as a simulation at the start values: a problem without parameters."""

    cases: tuple[tuple[Recording, str, Experiment], ...]
    label: str = "recordings"
    names: tuple[str, ...] = ()
    samples: int = 1

    @property
    def size(self) -> int:
        return len(self.cases)

    def decode(self, vectors: FloatArray) -> FloatArray:
        return vectors

    def jobs(
        self, want: Want, values: Sequence[Mapping[str, float]], overrides: Mapping[str, float]
    ) -> list[Job]:
        return [Job(experiment.name, dict(overrides)) for *_, experiment in self.cases]

    def judge(self, want: Want, outcomes: Sequence[Outcome]) -> tuple[float, FloatArray]:
        return np.inf, np.zeros(0)


def _written(
    folder: Path,
    scenario: Scenario,
    cases: Sequence[tuple[Recording, str, Experiment]],
    outcomes: Sequence[Outcome],
    notes: tuple[str, ...],
    coupled: CouplingError | str,
) -> SimulateResult:
    """Compare, and write what was found; StudyError if every simulation failed."""
    results = tuple(
        _compare(scenario, recording, role, outcome)
        for (recording, role, _), outcome in zip(cases, outcomes, strict=True)
    )
    failures = Counter(r.reason for r in results if r.simulated is None)
    if failures and failures.total() == len(results):
        reason, number = failures.most_common(1)[0]
        raise StudyError(f"All {len(results)} simulations failed, {number} of them because {reason}.")
    files = [_write_csv(folder, r) for r in results if r.simulated is not None]
    said = coupled if isinstance(coupled, str) else coupled.sentence()
    result = SimulateResult(
        scenario,
        results,
        failures,
        (folder / RESULT, *files),
        (*notes, said) if said else notes,
        None if isinstance(coupled, str) else coupled,
    )
    partial = folder / f"{RESULT}.part"
    partial.write_text(json.dumps(result.to_dict(), indent=2, allow_nan=False) + "\n", encoding="utf-8")
    partial.replace(folder / RESULT)
    return result


def _coupling(
    scenario: Scenario,
    cases: Sequence[tuple[Recording, str, Experiment]],
    outcomes: Sequence[Outcome],
) -> CouplingError | str:
    """What coupling by steps costs on the first recording that could be simulated."""
    for (recording, _, experiment), outcome in zip(cases, outcomes, strict=True):
        if outcome.signals is not None:
            measured = outcome.signals.select([n for n in scenario.measured if n in outcome.signals])
            return coupling_error(
                scenario.fmu,
                scenario.simulation,
                experiment,
                {},
                measured,
                {n: recording.noise.get(n, 0.0) for n in measured.names},
            )
    return ""


def _cases(scenario: Scenario) -> list[tuple[Recording, str, Experiment]]:
    cases = []
    for role, recordings in (("fit", scenario.fit), ("validate", scenario.validate)):
        for recording in recordings:
            point = next((p for p in scenario.points if recording in (*p.fit, *p.validate)), None)
            space, fixed = scenario.parameters, scenario.fixed
            if point is not None:
                space, fixed = point.space, point.fixed
            start = space.assignments(space.decode(space.start()), recording.name) if len(space) else {}
            experiment = Experiment(
                name=f"{role}/{recording.name}",
                fmu=scenario.fmu.path,
                inputs=scenario.drive(recording),
                outputs=scenario.outputs,
                time=communication_points(scenario, recording),
                fixed={**fixed, **start, **recording.start},
                tolerance=scenario.simulation.tolerance,
                texts=scenario.texts,
            )
            cases.append((recording, role, experiment))
    return cases


def _compare(scenario: Scenario, recording: Recording, role: str, outcome: Outcome) -> SimulatedRecording:
    errors: Mapping[str, ChannelError] = {}
    if outcome.signals is not None:
        own = {name: channel.given_noise for name, channel in scenario.cost.channels.items()}
        given = {name: noise for name, noise in own.items() if noise is not None}
        errors = compare(recording, role, scenario.measured, given, outcome.signals).errors
    return SimulatedRecording(
        name=recording.name,
        role=role,
        temperature_degC=recording.temperature_degC,
        measured=recording.signals.select(scenario.measured),
        simulated=outcome.signals,
        errors=errors,
        status=str(outcome.status),
        reason=outcome.reason,
        duration_s=outcome.duration_s,
        console=outcome.console,
    )


def _residuals(scenario: Scenario, found: SimulatedRecording) -> list[Residual]:
    """What a simulation leaves of each compared signal, over its noise, where it counts."""
    if found.simulated is None:
        return []
    recording = next(r for r in (*scenario.fit, *scenario.validate) if r.name == found.name)
    time = recording.compared.time
    inside = time <= found.simulated.time[-1] * (1.0 + 1e-12) + 1e-9
    residuals = []
    for name in scenario.cost.channels:
        noise = found.errors[name].noise
        kept = inside & recording.counted(name)
        if not noise > 0.0 or not kept.any():
            continue
        simulated = found.simulated.select((name,)).resample(time[kept])[name]
        inputs = scenario.drive(recording).resample(time[kept])
        with np.errstate(over="ignore"):
            values = (simulated - recording.compared[name][kept]) / noise
        residuals.append(
            Residual(
                found.name,
                name,
                values,
                noise,
                found.errors[name].unit,
                {n: inputs[n] for n in inputs.names},
                time[kept],
                simulated,
                np.empty((int(np.sum(kept)), 0)),  # nothing is fitted here
            )
        )
    return residuals


def _write_csv(folder: Path, result: SimulatedRecording) -> Path:
    """Columns ``time [s]``, ``<name> [unit]`` and, where recorded, ``<name> measured [unit]``."""
    assert result.simulated is not None
    simulated = result.simulated
    measured = result.measured.resample(simulated.time)
    header, columns = ["time [s]"], [simulated.time]
    for name in simulated.names:
        header.append(f"{name} [{simulated.units[name]}]")
        columns.append(simulated[name])
        if name in measured:
            header.append(f"{name} measured [{measured.units[name]}]")
            columns.append(measured[name])
    safe = re.sub(r"[^\w.+-]+", "_", f"{result.role}_{result.name}")
    path = folder / f"{safe}.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(zip(*(column.tolist() for column in columns), strict=True))
    return path
