"""``[profile]`` of a tuning: recordings that drive its responses, read and checked against the FMU."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from thsa_cosim.errors import ScenarioError
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.recordings import Recording, TimeAxis, read_recording
from thsa_cosim.scenario import check
from thsa_cosim.scenario.files import expand, named
from thsa_cosim.scenario.tune_model import PROFILE, Axis, CommandSpec, Profile
from thsa_cosim.scenario.tune_schema import TuneTable

OF_THE_END = ("rise_time", "overshoot", "settling_time")
"""Metrics that are relative to the command's last value."""


def read_profiles(path: Path, table: TuneTable, fmu: FmuDescription) -> tuple[Recording, ...]:
    """The recordings of ``[profile]``, in the FMU's units; none without the table.

    Raises
    ------
    ScenarioError
        For a column that is no input, an input that is a condition as well, a command that is not recorded.
    RecordingError, UnitError
        As the files deserve.
    """
    spec, recorded = table.profile, table.command.shape == "recorded"
    if spec is None:
        if recorded:
            raise ScenarioError(
                "command.shape = 'recorded' needs the table [profile] with the command's column."
            )
        return ()
    for name in spec.columns:
        variable = check.find_variable(fmu, name, f"profile.columns.{name}", fmu.inputs)
        if variable.causality != "input" or not variable.is_float:
            raise ScenarioError(f"profile.columns.{name} is no real input of {fmu.path.name}; remove it.")
        if name in table.conditions:
            raise ScenarioError(f"conditions.{name} is a column of [profile] as well; remove one of them.")
    if recorded != (table.command.input in spec.columns):
        remedy = "add its column" if recorded else "remove its column, or set command.shape = 'recorded'"
        raise ScenarioError(f"profile.columns.{table.command.input} is the command's input; {remedy}.")
    columns = {name: column.source() for name, column in spec.columns.items()}
    units = {name: fmu.variables[name].unit or None for name in columns}
    axis = TimeAxis(**spec.time.model_dump())
    return tuple(
        read_recording(file, columns, time=axis, units=units, name=name, driven=frozenset(columns))
        for file, name in named(expand(path, "profile.recordings", spec.recordings, ()))
    )


def with_command(recording: Recording, table: TuneTable, command: CommandSpec | None) -> Profile:
    """A profile with ``command``, or with its own where that is recorded (None).

    Raises ScenarioError for a recording that is shorter than the command, or than two steps.
    """
    own, spec = recording.signals, table.command
    if command is not None:
        if own.time[-1] < command.time[-1] - 1e-9:
            raise ScenarioError(
                f"{recording.path} ends at {own.time[-1]:g} s, before command.stop; lower that."
            )
        return Profile(recording, own, command)
    end = min(float(own.time[-1]), spec.stop or np.inf)
    if end < 2.0 * spec.step:
        raise ScenarioError(f"{recording.path} is shorter than two steps of command.step; lower that.")
    time = spec.step * np.arange(int(np.floor(end / spec.step * (1.0 + 1e-12))) + 1, dtype=np.float64)
    values = own.select((spec.input,)).resample(time)[spec.input]
    moving = np.flatnonzero(values != values[0])
    begin = float(time[max(moving[0] - 1, 0)]) if moving.size else 0.0
    inputs = own.select([name for name in own.names if name != spec.input])
    unit = own.units.get(spec.input, "1")
    ends_at_most = abs(float(values[-1])) >= float(np.max(np.abs(values))) > 0.0
    command = CommandSpec(spec.input, spec.output, unit, time, values, begin, 1.0, ends_at_most)
    _check_end(recording, table, command)
    return Profile(recording, inputs, command)


def _check_end(recording: Recording, table: TuneTable, command: CommandSpec) -> None:
    if command.ends_at_most:
        return
    asked = [
        f"requirements[{k}].{r.metric}" for k, r in enumerate(table.requirements, 1) if r.metric in OF_THE_END
    ]
    asked += ["cost.kappa_rise"] if table.cost.kappa_rise > 0.0 else []
    if asked:
        raise ScenarioError(
            f"{asked[0]}: the command of {recording.path} does not end at its largest value, so that it has no rise,"
            f" overshoot or settling; cut it with command.stop, or weigh the tracking alone."
        )


def finished(profiles: Sequence[Profile], factor: float) -> tuple[Profile, ...]:
    """The profiles with the factor that turns the output's unit into the command's."""
    return tuple(replace(p, command=replace(p.command, factor=factor)) for p in profiles)


def profile_axis(count: int) -> tuple[Axis, ...]:
    """The axis that numbers ``count`` profiles; none for 0."""
    numbers = tuple(float(k) for k in range(1, count + 1))
    return (Axis(PROFILE, "", "", numbers, (1.0,) * count, is_input=False),) if count else ()
