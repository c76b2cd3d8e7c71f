"""How the FMUs of a study are run: what the scenario fixes, else what trials find (inputs, processes)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np

from thsa_cosim.batch import Experiment
from thsa_cosim.batch.handling import HandlingTrial, try_input_handling
from thsa_cosim.batch.repetition import Repetition, try_repetition
from thsa_cosim.errors import FmuError, ParameterError
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.inputs import input_variables, is_linear, is_ours
from thsa_cosim.fmu.plant import Kind
from thsa_cosim.scenario.schema import SimulationTable
from thsa_cosim.system import read_description

WARN = 1e-3
"""A deviation over range, from half the step or Model Exchange, above which results are doubted."""
_STEPS = 4000
"""Communication steps of a trial; more only until the inputs have begun to move."""
_trials: dict[tuple[str, str, tuple[str, ...], int, bytes], HandlingTrial] = {}
_repetitions: dict[tuple[str, str, int, str], Repetition] = {}


@dataclass(frozen=True)
class Settled:
    """What a runner is opened with."""

    interface: Kind | None
    modes: tuple[str | None, ...]
    """One per experiment; None: as its FMU is trusted."""
    notes: tuple[str, ...]
    limits: Mapping[str, int] = field(default_factory=dict)
    """Further options of the runner."""


def settle(spec: SimulationTable, experiments: Sequence[Experiment]) -> Settled:
    """Settle the inputs of foreign FMUs, and whether their runs may share a process."""
    settled = settle_handling(spec, experiments)
    modes, kind = settled.modes, settled.interface
    found: dict[str, Repetition] = {}
    foreign_of = cache(_foreign)  # many experiments, one FMU
    for experiment, mode in zip(experiments, modes, strict=True):
        foreign = foreign_of(experiment.fmu)
        if foreign is not None and foreign.sha256 not in found:
            found[foreign.sha256] = _repetition(spec, foreign, replace(experiment, input_mode=mode), kind)
    faults = [repetition for repetition in found.values() if repetition.fault]
    if not faults:
        return settled
    limits = faults[0].limits
    settled = settle_handling(spec, experiments, limits)  # the first trials have shared their processes
    kept = (
        f"The FMU keeps something in its process: {faults[0].fault}, a new process nothing. Every run gets a "
        f"separate process, which costs about half a second each."
    )
    return replace(settled, notes=(*settled.notes, kept), limits=limits)


def _foreign(fmu: Path) -> FmuDescription | None:
    try:
        description = read_description(fmu)
    except FmuError:
        return None  # said elsewhere
    return None if is_ours(description) else description


def _repetition(
    spec: SimulationTable, description: FmuDescription, experiment: Experiment, kind: Kind | None
) -> Repetition:
    short = _short(experiment)
    key = description.sha256, experiment.name, len(short.time), repr((kind, spec.reuse, short.input_mode))
    if key not in _repetitions:
        options = {"kind": kind, "reuse": spec.reuse, "stepping": spec.stepping, "deadline_s": spec.deadline}
        _repetitions[key] = try_repetition(short, **options)
    return _repetitions[key]


def settle_handling(
    spec: SimulationTable, experiments: Sequence[Experiment], limits: Mapping[str, int] | None = None
) -> Settled:
    """Try each foreign Co-Simulation FMU once on the first of its experiments that has inputs.

    The choice depends on the FMU, the scenario and the recordings alone, so that a continued study makes it again.
    """
    found: dict[str, HandlingTrial] = {}
    digests: dict[int, str] = {}
    read = cache(read_description)
    for index, experiment in enumerate(experiments):
        description = _in_question(spec, experiment, read)
        if description is None:
            continue
        digests[index] = description.sha256
        if description.sha256 not in found:
            trial = _trial(spec, description, experiment, limits or {})
            if trial is not None:
                found[description.sha256] = trial
    interface = spec.interface
    everywhere = len(digests) == len(experiments) and set(digests.values()) == set(found)
    if spec.interface is None and spec.inputs is None and everywhere:
        kinds = {trial.kind for trial in found.values()}
        if kinds == {"model-exchange"}:
            interface = "model-exchange"
    modes: list[str | None] = []
    for index in range(len(experiments)):
        best = found[digests[index]].best if digests.get(index) in found else None
        modes.append(spec.inputs or (best.mode if best is not None else None))
    notes = [_note(spec, trial, interface) for trial in found.values()]
    return Settled(interface, tuple(modes), tuple(note for note in notes if note))


def _in_question(
    spec: SimulationTable, experiment: Experiment, read: Callable[[Path], FmuDescription]
) -> FmuDescription | None:
    """The FMU's description if there is anything to find out about its inputs."""
    if spec.interface == "model-exchange" or experiment.inputs is None:
        return None
    try:
        description = read(experiment.fmu)
        linear = [
            v for v in input_variables(description, experiment.inputs) if is_linear(experiment.inputs, v)
        ]
    except (FmuError, ParameterError):
        return None  # said elsewhere, or a wrapper's inputs
    foreign = description.supports_co_simulation and not is_ours(description)
    return description if foreign and linear else None


def _trial(
    spec: SimulationTable, description: FmuDescription, experiment: Experiment, limits: Mapping[str, int]
) -> HandlingTrial | None:
    assert experiment.inputs is not None
    short = _short(experiment)
    table = np.array([experiment.inputs[name] for name in experiment.inputs.names])
    rest = sorted(short.fixed.items()), dict(experiment.texts), spec.tolerance, dict(limits)
    excitation = table.tobytes() + repr(rest).encode()
    key = description.sha256, experiment.name, tuple(experiment.outputs), len(short.time), excitation
    if key not in _trials:
        try:
            _trials[key] = try_input_handling(short, deadline_s=spec.deadline, **limits)
        except (FmuError, ParameterError):
            return None
    return _trials[key]


def _short(experiment: Experiment) -> Experiment:
    """The begin of an experiment, until its inputs have moved for a while, without what belongs to its wrapper."""
    begin = 0.0
    if experiment.inputs is not None:
        table = np.array([experiment.inputs[name] for name in experiment.inputs.names])
        moving = np.flatnonzero((np.diff(table, axis=1) != 0.0).any(axis=0))
        begin = float(experiment.inputs.time[moving[0]]) if len(moving) else 0.0
    count = _STEPS + int(np.searchsorted(experiment.time, begin))
    own = experiment.wrapper_names
    fixed = {name: value for name, value in experiment.fixed.items() if name not in own}
    return replace(experiment, time=experiment.time[: count + 1], fixed=fixed)


def _note(spec: SimulationTable, trial: HandlingTrial, interface: Kind | None) -> str:
    """What is used, and a warning with figures where it is not to be trusted."""
    best = trial.best
    if best is None:
        return f"How inputs reach the FMU could not be tried: {trial.sentence()}."
    if interface == "model-exchange":
        return f"Inputs: {trial.sentence()}."
    used = next((way for way in trial.ways if way.mode == spec.inputs), best)
    chosen = f"Inputs: {trial.sentence()}."
    if spec.inputs is not None:
        chosen = f"Inputs: {used.mode!r}, as the scenario says; a trial would have used {trial.sentence()}."
    if used.error <= WARN:
        return chosen
    return (
        f"{chosen} WARNING: {used.worst} of this Co-Simulation is {used.error:.1e} of its range off "
        f"{trial.reference} on these recordings ({used.halved:.1e} with half the step): identified values carry that "
        f'error; lower simulation.step, or set simulation.interface = "model-exchange" if the FMU offers it.'
    )
