"""From the table of a tuning to a :class:`TuneScenario`, checked against its FMU."""

import importlib.util
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from thsa_cosim.errors import MissingExtraError, ScenarioError, UnitError, did_you_mean
from thsa_cosim.fmu import FmuDescription, Variable
from thsa_cosim.parameters import Parameter, ParameterSpace
from thsa_cosim.recordings import Recording
from thsa_cosim.scenario import check
from thsa_cosim.scenario.metrics_schema import (
    LOOP_METRICS,
    METRICS,
    START_METRICS,
    LoopTable,
    RequirementTable,
    StartTable,
)
from thsa_cosim.scenario.parameter_set import with_parameter_set
from thsa_cosim.scenario.schema import SearchTable
from thsa_cosim.scenario.system import open_model
from thsa_cosim.scenario.tune_drawn import checked_line, checked_pareto, checked_surface
from thsa_cosim.scenario.tune_model import (
    PROFILE,
    Axis,
    CommandSpec,
    ControlCostSpec,
    LoopSpec,
    Profile,
    Requirement,
    ScheduleSpec,
    TuneScenario,
)
from thsa_cosim.scenario.tune_profile import finished, profile_axis, read_profiles, with_command
from thsa_cosim.scenario.tune_schema import ConditionTable, TuneTable
from thsa_cosim.scenario.tune_uncertainty import read_uncertainty
from thsa_cosim.signals import FloatArray
from thsa_cosim.system.description import SystemDescription
from thsa_cosim.units import convert


def resolve_tune(
    path: Path, table: TuneTable, seed: int | None, model: FmuDescription | Path | str | None
) -> TuneScenario:
    """Return the scenario of ``table``; arguments (``model`` is ``fmu``) and errors as of ``load``."""
    fmu = open_model(path, table, model)
    given, table = with_parameter_set(path, table, fmu)
    profiles = _profiles(table, fmu, read_profiles(path, table, fmu))
    command = profiles[0].command if profiles else _command(table, fmu)
    axes = tuple(_axis(name, axis, fmu, f"conditions.{name}") for name, axis in table.conditions.items())
    _all_driven(table, fmu, command, axes)
    axes += profile_axis(len(profiles))
    space = ParameterSpace(tuple(_gain(table, k, fmu) for k in range(len(table.parameters))))
    fixed = check.fixed(path, table, fmu, space, given)
    for name in table.conditions:
        if name in fixed or name in [p.variable for p in space.parameters]:
            raise ScenarioError(f"conditions.{name} is set in [fixed] or tuned as well; remove one of them.")
    for key, values in {
        "before": table.before,
        **{f"compare.{n}": v for n, v in table.compare.items()},
    }.items():
        _all_gains(key, values, space)
    if table.simulation.step is not None:
        raise ScenarioError("simulation.step has no meaning here; the command has its own step.")
    if table.metrics.effort is not None:
        check.readable(fmu, table.metrics.effort, "metrics.effort")
    ends = min([command.time[-1], *(p.command.time[-1] for p in profiles)])
    if table.metrics.window[0] > ends:
        raise ScenarioError("metrics.window begins after command.stop; move one of them.")
    if table.robust.combine == "worst" and any(axis.weights for axis in table.conditions.values()):
        raise ScenarioError("conditions: weights go with robust.combine = 'sum'; remove them or set it.")
    requirements = tuple(_requirement(k, r, table, command, fmu) for k, r in enumerate(table.requirements))
    return TuneScenario(
        path=path,
        table=table,
        title=table.title or path.stem,
        seed=table.seed if seed is None else seed,
        fmu=fmu,
        fixed=fixed,
        command=command,
        axes=axes,
        parameters=space,
        before=dict(table.before),
        compare={name: dict(values) for name, values in table.compare.items()},
        metrics=table.metrics,
        cost=_cost(table, command, fmu),
        requirements=requirements,
        loop=_loop(table, float(ends), fmu, space),
        start=_start(table, fmu),
        combine=table.robust.combine,
        uncertainty=read_uncertainty(path, table, axes, fmu),
        schedule=_schedule(table, axes, fmu),
        pareto=checked_pareto(table),
        line=checked_line(table, space),
        surface=checked_surface(table, space),
        search=SearchTable(method="differential-evolution", **table.search.model_dump()),
        simulation=table.simulation,
        profiles=profiles,
    )


def _all_driven(table: TuneTable, fmu: FmuDescription, command: CommandSpec, axes: Sequence[Axis]) -> None:
    """Every input gets its values from one place."""
    driven: set[str | None] = {
        command.input,
        *(axis.name for axis in axes),
        *(table.profile.columns if table.profile else ()),
    }
    if table.loop is not None and _interval(table.loop, fmu) is not None:
        driven.add(table.loop.disturbance)  # it is 0 but for the margins
    for variable in fmu.inputs:
        if variable.is_float and variable.name not in driven and not variable.may_stay_open:
            raise ScenarioError(
                f"conditions.{variable.name} is missing: input {variable.name!r} of {fmu.path.name} needs values."
            )
    if command.input in table.conditions:
        raise ScenarioError(f"conditions.{command.input} is the command's input; remove it.")


def _profiles(table: TuneTable, fmu: FmuDescription, recordings: Sequence[Recording]) -> tuple[Profile, ...]:
    if table.command.shape != "recorded":
        command = _command(table, fmu) if recordings else None
        return tuple(with_command(recording, table, command) for recording in recordings)
    source, follows = _command_variables(table, fmu)
    factor = _factor(source, follows)
    return finished([with_command(recording, table, None) for recording in recordings], factor)


def _command_variables(table: TuneTable, fmu: FmuDescription) -> tuple[Variable, Variable]:
    """The commanded input and the output that follows."""
    source = check.find_variable(fmu, table.command.input, "command.input", fmu.inputs)
    if source.causality != "input" or not source.is_float:
        raise ScenarioError(f"command.input: {table.command.input!r} of {fmu.path.name} is no real input.")
    return source, check.readable(fmu, table.command.output, "command.output")


def _factor(source: Variable, follows: Variable) -> float:
    """What turns the output's unit into the input's."""
    try:
        return convert(1.0, follows.unit, source.unit) if follows.unit and source.unit else 1.0
    except UnitError as error:
        raise UnitError(f"command: {error}") from None


def _command(table: TuneTable, fmu: FmuDescription) -> CommandSpec:
    spec = table.command
    source, follows = _command_variables(table, fmu)
    assert spec.stop is not None
    unit = spec.unit or source.unit or "1"
    time: FloatArray = spec.step * np.arange(round(spec.stop / spec.step) + 1, dtype=np.float64)
    begin = spec.begin
    values: FloatArray
    if spec.points is not None:
        corners = np.array(spec.points, dtype=np.float64)
        values = np.interp(time, corners[:, 0], corners[:, 1])
        moving = np.flatnonzero(np.diff(corners[:, 1]))
        begin = float(corners[moving[0], 0]) if moving.size else 0.0
        if float(corners[-1, 0]) > time[-1] + 1e-9:
            raise ScenarioError("command.points run beyond command.stop; raise it or cut them.")
    elif spec.shape == "ramp" and spec.final is not None and spec.rate is not None:
        rise = np.minimum(spec.rate * np.maximum(time - begin, 0.0), abs(spec.final))
        values = np.asarray(np.sign(spec.final) * rise, dtype=np.float64)
    else:
        values = np.where(time >= begin - 1e-12, float(spec.final or 0.0), 0.0)
    try:
        values = convert(values, unit, source.unit or unit)
    except UnitError as error:
        raise UnitError(f"command: {error}") from None
    return CommandSpec(spec.input, spec.output, unit, time, values, begin, _factor(source, follows))


def _axis(name: str, table: ConditionTable, fmu: FmuDescription, key: str) -> Axis:
    variable = check.find_variable(fmu, name, key, fmu.inputs + fmu.parameters)
    if variable.causality != "input":
        check.settable(fmu, name, key)
    if not variable.is_float:
        raise ScenarioError(f"{key}: {name!r} is a {variable.type}; only real numbers can be conditions.")
    if table.values is not None:
        values = [float(v) for v in table.values]
    else:
        assert table.from_ is not None
        assert table.to is not None
        assert table.step is not None
        count = int(np.floor((table.to - table.from_) / table.step * (1 + 1e-9))) + 1
        values = [table.from_ + k * table.step for k in range(count)]
    unit = table.unit or variable.unit or "1"
    axis = Axis(
        name=name,
        unit=unit,
        fmu_unit=variable.unit or unit,
        values=tuple(values),
        weights=tuple(table.weights or [1.0] * len(values)),
        is_input=variable.causality == "input",
    )
    try:
        for value in values:
            check.check_range(variable, axis.to_fmu(value), key, fmu)
    except UnitError as error:
        raise UnitError(f"{key}: {error}") from None
    return axis


def _gain(table: TuneTable, k: int, fmu: FmuDescription) -> Parameter:
    p = table.parameters[k]
    key = f"parameters[{p.name}].variable"
    variable = check.settable(fmu, p.variable, key)
    if not variable.is_float:
        raise ScenarioError(f"{key}: {p.variable!r} is a {variable.type}; only real numbers are searched.")
    parameter = Parameter(
        p.name, p.variable, p.unit, p.lower, p.upper, p.scale, p.start,
        p.description or variable.description, variable.unit or None,
    )  # fmt: skip
    for side in ("lower", "upper"):
        value = parameter.to_variable(getattr(p, side))
        check.check_range(variable, value, f"parameters[{p.name}].{side}", fmu)
    return parameter


def _all_gains(key: str, values: Mapping[str, float], space: ParameterSpace) -> None:
    for name in values:
        if name not in space.names:
            raise ScenarioError(
                f"{key}.{name} is no parameter of [[parameters]].{did_you_mean(name, space.names)}"
            )
    for name in space.names:
        if name not in values:
            raise ScenarioError(f"{key}.{name} is missing; give every parameter a value.")


def _requirement(
    k: int, spec: RequirementTable, table: TuneTable, command: CommandSpec, fmu: FmuDescription
) -> Requirement:
    key = f"requirements[{k + 1}]"
    limit = spec.maximum if spec.maximum is not None else spec.minimum
    assert limit is not None
    unit, scale = METRICS[spec.metric]
    if spec.metric in LOOP_METRICS and table.loop is None:
        raise ScenarioError(
            f"{key}: {spec.metric} needs the table [loop] with the signal to open the loop at."
        )
    if spec.metric in START_METRICS:
        if table.start is None or spec.metric not in table.start.terms:
            raise ScenarioError(
                f"{key}: {spec.metric} needs the table [start] with current, voltage and their limits."
            )
        unit = unit or fmu.variables[table.start.current].unit or "1"
    if spec.metric == "effort":
        if table.metrics.effort is None:
            raise ScenarioError(f"{key}: effort needs metrics.effort, the signal that counts.")
        unit = fmu.variables[table.metrics.effort].unit or "1"
    if spec.metric == "tracking_error":
        unit = table.cost.unit or command.unit
    if spec.metric == "peak" and spec.signal is not None:
        variable: Variable = check.readable(fmu, spec.signal, f"{key}.signal")
        unit = variable.unit or "1"
        try:
            limit = convert(limit, spec.unit, unit) if spec.unit else limit
        except UnitError as error:
            raise UnitError(f"{key}: {error}") from None
        scale = abs(limit) or 1.0
    return Requirement.resolved(spec, unit=unit, limit=limit, scale=spec.scale or scale)


def _cost(table: TuneTable, command: CommandSpec, fmu: FmuDescription) -> ControlCostSpec:
    unit = table.cost.unit or command.unit
    source = fmu.variables[command.input].unit
    try:
        scale = convert(1.0, unit, source) if source else 1.0
    except UnitError as error:
        raise UnitError(f"cost.unit: {error}") from None
    return ControlCostSpec.resolved(table.cost, unit=unit, scale=scale)


def _loop(table: TuneTable, ends: float, fmu: FmuDescription, space: ParameterSpace) -> LoopSpec | None:
    if table.loop is None:
        return None
    check.readable(fmu, table.loop.signal, "loop.signal")
    at = ends if table.loop.at is None else table.loop.at
    if at > ends:
        raise ScenarioError("loop.at lies after the end of the command; lower it.")
    interval = _interval(table.loop, fmu)
    if table.loop.disturbance is None and not fmu.supports_model_exchange:
        raise ScenarioError(
            f"[loop]: {fmu.path.name} has no Model Exchange, which linearising needs; export it with both or"
            f" remove the table."
        )
    if table.simulation.reuse == "reset":
        raise ScenarioError("[loop] needs simulation.reuse = 'fresh': only one instance may live at a time.")
    names = table.loop.gains or list(space.names)
    for name in names:
        if name not in space.names:
            raise ScenarioError(f"loop.gains: {name!r} is no parameter.{did_you_mean(name, space.names)}")
    if table.loop.margins == "python-control" and importlib.util.find_spec("control") is None:
        raise MissingExtraError("loop.margins = 'python-control'", "control")
    variables = tuple(space[name].variable for name in names)
    return LoopSpec.resolved(table.loop, at=at, gains=variables, interval=interval)


def _interval(loop: LoopTable, fmu: FmuDescription) -> float | None:
    """Interval of the disturbance that measures the margins; None where the FMU is linearised."""
    if loop.disturbance is None:
        if isinstance(fmu, SystemDescription):
            raise ScenarioError(
                "[loop]: a system that is coupled at run time is not linearised, its margins are measured: name a"
                " 'disturbance' in the connection to the controller's measured input, and here with 'amplitude'."
            )
        return None
    known = [v.name for v in fmu.inputs]
    if loop.disturbance not in known:
        raise ScenarioError(
            f"loop.disturbance: {loop.disturbance!r} is no input; name it in the connection to {loop.signal!r}."
            f"{did_you_mean(loop.disturbance, known)}"
        )
    if loop.amplitude is None:
        raise ScenarioError(f"loop.amplitude is missing: the largest value that is added to {loop.signal!r}.")
    steps = [
        c.step
        for c in (fmu.system.components if isinstance(fmu, SystemDescription) else ())
        if c.execution == "sampled" and loop.signal.startswith(f"{c.name}.")
    ]
    interval = loop.interval or next(iter(steps), None)
    if interval is None:
        raise ScenarioError(f"loop.interval is missing: {loop.signal!r} is read by no sampled component.")
    return interval


def _start(table: TuneTable, fmu: FmuDescription) -> StartTable | None:
    if table.start is not None:
        for key in ("current", "voltage"):
            name = getattr(table.start, key)
            if name is not None:
                check.readable(fmu, name, f"start.{key}")
    return table.start


def _schedule(table: TuneTable, axes: Sequence[Axis], fmu: FmuDescription) -> ScheduleSpec | None:
    spec = table.schedule
    if spec is None:
        return None
    known = [axis.name for axis in axes if axis.name != PROFILE]
    for name in (*spec.over, *spec.check):
        if name not in known:
            raise ScenarioError(f"schedule: {name!r} is none of the [conditions].{did_you_mean(name, known)}")
    for name in spec.over:
        axis = next(a for a in axes if a.name == name)
        if len(axis.values) < 2 or list(axis.values) != sorted(axis.values):
            raise ScenarioError(f"conditions.{name}: a schedule needs two or more values in rising order.")
    if len(set(spec.over)) < len(spec.over):
        raise ScenarioError("schedule.over names a condition twice; remove one.")
    swept = {name: _axis(name, t, fmu, f"schedule.check.{name}") for name, t in spec.check.items()}
    return ScheduleSpec.resolved(spec, check=tuple(swept.get(a.name, a) for a in axes))
