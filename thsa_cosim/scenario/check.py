"""A scenario against its FMU: every variable exists, has the right role, unit and range."""

import fnmatch
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from thsa_cosim.errors import ParameterError, ScenarioError, did_you_mean, did_you_mean_path
from thsa_cosim.fmu import FmuDescription, Variable
from thsa_cosim.parameters import Parameter, ParameterSpace
from thsa_cosim.scenario.diagnose_schema import DiagnoseOptionsTable
from thsa_cosim.scenario.formula import parse_formula
from thsa_cosim.scenario.model import BlackBoxSpec, DiagnoseSpec, ForceSpec
from thsa_cosim.scenario.schema import (
    CommonTable,
    DiagnoseTable,
    IdentifyTable,
    ParameterTable,
    SimulateTable,
)
from thsa_cosim.scenario.table import FileTable
from thsa_cosim.scenario.tune_schema import TuneTable
from thsa_cosim.shipped import modelica_package

_SETTABLE = ("parameter", "structuralParameter")


def find_variable(
    fmu: FmuDescription, name: str, key: str, candidates: tuple[Variable, ...] = ()
) -> Variable:
    """Return the FMU's variable; ScenarioError with the closest of ``candidates`` (default: all)."""
    if name in fmu.variables:
        if fmu.variables[name].is_array:
            raise ScenarioError(
                f"{key}: {name!r} of {fmu.path.name} is an array; only single numbers are supported."
            )
        return fmu.variables[name]
    known = [v.name for v in candidates] or list(fmu.variables)
    hint = did_you_mean(name, known) or did_you_mean(name, fmu.variables)
    if not hint and 0 < len(known) <= 12:
        hint = f" It has {', '.join(known)}."
    raise ScenarioError(f"{key}: {fmu.path.name} has no variable {name!r}.{hint}")


def roles(table: CommonTable, fmu: FmuDescription) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the FMU's inputs and the measured outputs among ``recordings.columns``.

    Raises
    ------
    ScenarioError
        If a column belongs to no signal of the FMU, an input has no column, or the temperature's is missing.
    """
    columns = table.recordings.columns
    inputs, measured = [], []
    for name, column in columns.items():
        key = f"recordings.columns.{name}"
        variable = find_variable(fmu, name, key, fmu.inputs + fmu.outputs)
        if variable.type == "String" and variable.causality in ("input", *_SETTABLE):
            raise ScenarioError(f"{key} is a text of {fmu.path.name}, not a signal; give it in [fixed].")
        if variable.causality == "input":
            inputs.append(name)
        elif variable.causality in ("output", "local") and variable.type != "String":
            if column.column is None:
                raise ScenarioError(f"{key} is an output, which cannot be a constant; name its column.")
            if column.smooth == "piecewise-linear":
                raise ScenarioError(
                    f"{key}.smooth: {column.smooth!r} is for inputs; outputs are compared as measured."
                )
            measured.append(name)
        elif not (variable.causality in _SETTABLE and variable.is_float):
            raise ScenarioError(f"{key} is a {variable.causality} of {fmu.path.name}; set it in [fixed].")
    for wanted in fmu.inputs:
        if wanted.name not in columns and wanted.is_float and not wanted.may_stay_open:
            raise ScenarioError(
                f"recordings.columns.{wanted.name} is missing: input {wanted.name!r} of {fmu.path.name} needs"
                f" a column or a value."
            )
    source = table.temperature.input if table.temperature else None
    if source is not None and source not in columns:
        find_variable(fmu, source, "temperature.input", fmu.inputs)
        raise ScenarioError(f"temperature.input {source!r} has no column; add [recordings.columns.{source}].")
    return tuple(inputs), tuple(measured)


def started(table: CommonTable, fmu: FmuDescription) -> tuple[str, ...]:
    """Return the FMU's parameters among ``recordings.columns``: each recording gives them its own start value.

    Raises
    ------
    ScenarioError
        If the parameter is searched for or fixed as well, or the column is treated as a signal.
    """
    found = []
    searched = {p.variable: p.name for p in table.parameters} if isinstance(table, IdentifyTable) else {}
    for name, column in table.recordings.columns.items():
        if fmu.variables[name].causality not in _SETTABLE:
            continue
        key = f"recordings.columns.{_quoted(name)}"
        if column.value is not None:
            raise ScenarioError(f"{key}: a parameter's constant belongs in [fixed]; name a column.")
        if name in searched:
            raise ScenarioError(f"{key} is searched for as parameter {searched[name]!r}; remove one of them.")
        if name in table.fixed:
            raise ScenarioError(f"{key} is in [fixed], too; remove one of them.")
        found.append(name)
    return tuple(found)


def outputs(table: CommonTable, fmu: FmuDescription, measured: tuple[str, ...]) -> tuple[str, ...]:
    """Return what is simulated: the measured outputs and, for ``simulate``, those that it asks for."""
    if not isinstance(table, SimulateTable):
        return measured
    for name in table.outputs:
        variable = find_variable(fmu, name, "outputs", fmu.outputs)
        if variable.type == "String":
            raise ScenarioError(f"outputs: {name!r} of {fmu.path.name} is a text; only numbers are recorded.")
    own = tuple(v.name for v in fmu.outputs if v.type != "String" and not v.is_array)
    return tuple(dict.fromkeys((*measured, *(table.outputs or own))))


def parameters(table: IdentifyTable, fmu: FmuDescription) -> tuple[tuple[Parameter, str], ...]:
    """Return each parameter in the FMU's terms, and whether it is one per point or per recording.

    Raises
    ------
    ScenarioError, ParameterError, UnitError
        If the variable is no parameter of the FMU, the unit does not convert, or the bounds leave the FMU's.
    """
    found = []
    for p in table.parameters:
        key = f"parameters[{p.name}].variable"
        variable = settable(fmu, p.variable, key)
        if not variable.is_float:
            raise ScenarioError(
                f"{key}: {p.variable!r} is a {variable.type}; only real numbers are searched."
            )
        plain = Parameter(
            p.name,
            p.variable,
            p.unit,
            p.lower,
            p.upper,
            p.scale,
            p.start,
            p.description,
            variable.unit or None,
        )
        low, high = sorted((plain.to_variable(p.lower), plain.to_variable(p.upper)))
        for key_name, value in (("lower", low), ("upper", high)):
            check_range(variable, value, f"parameters[{p.name}].{key_name}", fmu)
        found.append((replace(plain, description=p.description or variable.description), p.per))
    return tuple(found)


def force(table: IdentifyTable, fmu: FmuDescription, measured: tuple[str, ...]) -> ForceSpec | None:
    """Return what the force residual needs; ScenarioError if a signal is not measured or the mass no parameter."""
    spec = table.force
    if spec is None:
        return None
    for key in ("position", "force"):
        name = getattr(spec, key)
        if name not in measured:
            raise ScenarioError(
                f"force.{key}: {name!r} is no measured output; add [recordings.columns.{name}]."
                f"{did_you_mean(name, measured)}"
            )
    mass = settable(fmu, spec.mass, "force.mass").start
    if not isinstance(mass, float):
        raise ScenarioError(f"force.mass: {spec.mass!r} of {fmu.path.name} has no number as its start value.")
    return ForceSpec.resolved(spec, mass_at_start=mass)


def diagnosis(
    path: Path, table: DiagnoseTable, fmu: FmuDescription, inputs: Sequence[str], measured: Sequence[str]
) -> DiagnoseSpec:
    """Return what a diagnosis needs; ScenarioError for an input, a signal or a folder that is not there."""
    spec = table.diagnose
    for key in ("command", "load"):
        name = getattr(spec, key)
        if name is not None and name not in inputs:
            raise ScenarioError(
                f"diagnose.{key}: {name!r} is no input with a column.{did_you_mean(name, inputs)}"
            )
    for balance in spec.balances:
        for name in balance.moving_signals:
            if name not in (*inputs, *measured):
                raise ScenarioError(
                    f"diagnose.balances[{balance.name}].moving: {name!r} has no column."
                    f"{did_you_mean(name, (*inputs, *measured))}"
                )
        known = (*inputs, *measured, *(p.name for p in table.parameters))
        for text in (balance.left, *balance.terms):
            parse_formula(text, known, f"diagnose.balances[{balance.name}]")
    package = modelica_package(path.parent / "..") if spec.package is None else path.parent / spec.package
    own = None if spec.catalogue is None else path.parent / spec.catalogue
    if own is not None and not own.is_dir():
        raise ScenarioError(
            f"diagnose.catalogue: there is no folder {own}; correct the path.{did_you_mean_path(own)}"
        )
    return DiagnoseSpec.resolved(
        spec,
        model=_class_of(path, spec.model),
        package=package,
        catalogue=own,
        spreads={p.name: spec.spread if p.spread is None else p.spread for p in table.parameters},
        blackbox=_black_box(path, spec, fmu),
    )


def _class_of(path: Path, model: str | None) -> str | None:
    """Return the class's name, or the path of the ``.mo`` file that holds it; ScenarioError without that file."""
    if model is None or not model.endswith(".mo"):
        return model
    file = path.parent / model
    if not file.is_file():
        raise ScenarioError(
            f"diagnose.model: there is no file {file}; correct the path.{did_you_mean_path(file)}"
        )
    return str(file)


def _black_box(path: Path, spec: DiagnoseOptionsTable, fmu: FmuDescription) -> BlackBoxSpec | None:
    """Return the name map of an FMU without source; ScenarioError if it is missing, or names what is no number."""
    if (spec.model is None) is (spec.blackbox is None):
        raise ScenarioError(
            f"{path}: [diagnose] needs either model, the Modelica class that gets the effects, or"
            " [diagnose.blackbox], the names of an FMU without source."
        )
    if spec.blackbox is None:
        return None
    if spec.known:
        raise ScenarioError(
            f"{path}: diagnose.known needs diagnose.model, the Modelica class that gets the effects; an FMU without"
            " source takes none."
        )
    for key, name in spec.blackbox.model_dump(exclude_none=True).items():
        readable(fmu, name, f"diagnose.blackbox.{key}")
    return BlackBoxSpec.resolved(spec.blackbox, command=spec.command, load=spec.load)


def readable(fmu: FmuDescription, name: str, key: str) -> Variable:
    """Return a variable whose number can be recorded; ScenarioError otherwise."""
    variable = find_variable(fmu, name, key, fmu.outputs)
    if variable.type == "String":
        raise ScenarioError(f"{key}: {name!r} of {fmu.path.name} is a text; only numbers are recorded.")
    return variable


def settable(fmu: FmuDescription, name: str, key: str) -> Variable:
    """Return a variable that can be given a start value; ScenarioError otherwise."""
    variable = find_variable(fmu, name, key, fmu.parameters)
    if variable.causality in _SETTABLE or variable.takes_start:
        return variable
    remedy = (
        f"give it in [recordings.columns.{name}]" if variable.causality == "input" else "choose a parameter"
    )
    raise ScenarioError(
        f"{key}: {name!r} is a {variable.causality} of {fmu.path.name}, no parameter; {remedy}."
    )


def takes_text(fmu: FmuDescription, name: str) -> bool:
    """Whether a variable gets a text as its start value: a String parameter, or input, as a text has no course."""
    variable = fmu.variables.get(name)
    return variable is not None and variable.type == "String" and not variable.is_array


def check_range(variable: Variable, value: float, key: str, fmu: FmuDescription) -> None:
    """ParameterError if the FMU does not allow ``value`` (in its unit) for a variable."""
    if not variable.is_float and not (
        value in (0.0, 1.0) if variable.type == "Boolean" else value.is_integer()
    ):
        wanted = "true or false" if variable.type == "Boolean" else "a whole number"
        names = ", ".join(f"{number} ({item})" for item, number in variable.items[:8])
        raise ParameterError(
            f"{key}: {value:g} is not {wanted}; {variable.name!r} of {fmu.path.name} is of type {variable.type}"
            f"{': ' + names if names else ''}."
        )
    below = variable.minimum is not None and value < variable.minimum - 1e-12 * abs(variable.minimum)
    above = variable.maximum is not None and value > variable.maximum + 1e-12 * abs(variable.maximum)
    if below or above:
        limit = f"min = {variable.minimum:g}" if below else f"max = {variable.maximum:g}"
        raise ParameterError(
            f"{key}: {value:g} {variable.unit or ''}".rstrip()
            + f" is outside what {fmu.path.name} allows for {variable.name!r} ({limit})."
        )


def fixed(
    path: Path,
    table: CommonTable | TuneTable,
    fmu: FmuDescription,
    space: ParameterSpace,
    values: Mapping[str, float],
) -> dict[str, float]:
    """Return FMU start values: ``values`` of the parameter set, overridden by zeroed coefficients, then by ``[fixed]``.

    Raises
    ------
    ScenarioError, ParameterError, UnitError
        If a variable is no parameter, a glob matches none, or a value is searched for as well.
    """
    searched = {p.variable: p.name for p in space.parameters}
    own: dict[str, float] = {}
    for name, value in table.fixed.items():
        key = f"fixed.{_quoted(name)}"
        variable = _start_value(fmu, name, value, key)
        if isinstance(value, FileTable):
            _is_file(value.path(path.parent), f"{key}.file")
        if isinstance(value, str | FileTable):
            continue
        check_range(variable, float(value), key, fmu)
        if name in searched:
            raise ScenarioError(f"{key} is searched for as parameter {searched[name]!r}; remove one of them.")
        own[name] = float(value)
    for parameter in table.parameters if isinstance(table, IdentifyTable) else ():
        for pattern in parameter.zero:
            if pattern in own and own[pattern] != 0.0:
                raise ScenarioError(
                    f"parameters[{parameter.name}].zero sets {pattern!r} to 0, [fixed] to {own[pattern]:g};"
                    f" remove one of them."
                )
    zeros = {name: 0.0 for names in zeroed(table, fmu).values() for name in names}
    merged = {**values, **zeros, **own}
    return {name: value for name, value in merged.items() if name not in searched}


def _start_value(fmu: FmuDescription, name: str, value: float | str | FileTable, key: str) -> Variable:
    """Return the variable that ``[fixed]`` gives a start value of its type; ScenarioError otherwise."""
    is_text = takes_text(fmu, name)
    given = isinstance(value, str | FileTable)
    if is_text and given and fmu.variables[name].causality == "input":
        return fmu.variables[name]  # a text has no course over time: it is given like a parameter
    variable = settable(fmu, name, key)
    if given and not is_text:
        shown = value if isinstance(value, str) else value.file  # type: ignore[union-attr]
        raise ScenarioError(
            f"{key}: must be a number, not {shown!r}; {name!r} of {fmu.path.name} is of type {variable.type}."
        )
    if is_text and not given:
        raise ScenarioError(
            f"{key}: {name!r} of {fmu.path.name} is a text; give it in quotes, not {value!r}."
        )
    if isinstance(value, str) and "\0" in value:
        raise ScenarioError(f"{key}: the text holds a null character; remove it.")
    return variable


def _is_file(file: Path, key: str) -> None:
    if not file.is_file():
        raise ScenarioError(f"{key}: there is no file {file}; correct the path.{did_you_mean_path(file)}")


def zeroed(table: CommonTable | TuneTable, fmu: FmuDescription) -> dict[str, tuple[str, ...]]:
    """Return, by parameter name, the FMU parameters that its ``zero`` and ``law_block`` set to 0."""
    if not isinstance(table, IdentifyTable):
        return {}
    apart = {p.variable for p in table.parameters} | set(table.fixed)
    return {
        p.name: tuple(dict.fromkeys(n for n in _zeroed(fmu, p) if n not in apart)) for p in table.parameters
    }


def _zeroed(fmu: FmuDescription, parameter: ParameterTable) -> list[str]:
    """Return the FMU parameters that ``zero`` (names and globs) and ``law_block`` set to 0."""
    known = [v.name for v in fmu.parameters if v.is_float]
    names: list[str] = []
    for pattern in parameter.zero:
        if pattern in fmu.variables:
            names.append(settable(fmu, pattern, f"parameters[{parameter.name}].zero").name)
        elif matches := fnmatch.filter(known, pattern):
            names += matches
        else:
            raise ScenarioError(
                f"parameters[{parameter.name}].zero: {pattern!r} matches no parameter of {fmu.path.name}."
                f"{did_you_mean(pattern, known)}"
            )
    if parameter.law_block is not None:
        inside = [n for n in known if n.rpartition(".")[0] == parameter.law_block]
        if not inside:
            blocks = {n.rpartition(".")[0] for n in known} - {""}
            raise ScenarioError(
                f"parameters[{parameter.name}].law_block: {fmu.path.name} has no block"
                f" {parameter.law_block!r} with parameters.{did_you_mean(parameter.law_block, blocks)}"
            )
        names += inside
    return [n for n in names if n != parameter.variable]


def _quoted(name: str) -> str:
    return f'"{name}"' if "." in name else name
