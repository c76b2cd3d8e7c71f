"""The ``parameter_set`` of a scenario: values of an SSV file as start values of the FMU, each in its type."""

from pathlib import Path
from typing import TypeVar

from thsa_cosim.errors import ParameterError, UnitError
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.fmu.variable import Variable
from thsa_cosim.scenario.check import check_range, settable, takes_text
from thsa_cosim.scenario.schema import CommonTable
from thsa_cosim.scenario.table import StartValue
from thsa_cosim.scenario.tune_schema import TuneTable
from thsa_cosim.ssv import ParameterSet, read_ssv
from thsa_cosim.units import convert

TableT = TypeVar("TableT", CommonTable, TuneTable)


def with_parameter_set(path: Path, table: TableT, fmu: FmuDescription) -> tuple[dict[str, float], TableT]:
    """Return the numbers of the parameter set, by variable in the FMU's units, and ``table`` with its texts.

    Texts join ``[fixed]``, which wins over them. Names of items of enumerations become numbers.

    Raises
    ------
    ScenarioError, ParameterError, UnitError
        In one sentence that names the file: no such parameter, a value of another type, an unknown item, a unit that
        does not convert.
    """
    if table.parameter_set is None:
        return {}, table
    file = path.parent / table.parameter_set
    given = read_ssv(file)
    key = f"parameter_set ({file.name})"
    numbers: dict[str, float] = {}
    for name, value in given.values.items():
        variable = settable(fmu, name, key)
        if variable.type == "String":
            raise ParameterError(
                f"{file}: {name!r} of {fmu.path.name} is a text; give it as a String, not {value:g}."
            )
        numbers[name] = _converted(file, given, variable, value)
    texts: dict[str, str] = {}
    for name, text in given.texts.items():
        if given.others[name] == "Enumeration":
            numbers[name] = _item(file, settable(fmu, name, key), text, fmu)
        elif takes_text(fmu, name):
            texts[name] = text
        else:
            variable = settable(fmu, name, key)
            raise ParameterError(
                f"{file}: {name!r} of {fmu.path.name} is of type {variable.type} and takes no String;"
                f" give it as a {variable.type}."
            )
    for name, number in numbers.items():
        check_range(fmu.variables[name], number, key, fmu)
    if not texts:
        return numbers, table
    fixed: dict[str, StartValue] = {**texts, **table.fixed}
    return numbers, table.model_copy(update={"fixed": fixed})


def _converted(file: Path, given: ParameterSet, variable: Variable, value: float) -> float:
    unit = given.units.get(variable.name)
    try:
        return convert(value, unit, variable.unit) if unit and variable.unit else value
    except UnitError as error:
        raise UnitError(f"{file}: {variable.name!r}: {error}") from None


def _item(file: Path, variable: Variable, text: str, fmu: FmuDescription) -> float:
    """Number of an enumeration's item, given by its name or by that number."""
    if variable.type != "Enumeration":
        raise ParameterError(
            f"{file}: {variable.name!r} of {fmu.path.name} is of type {variable.type} and takes no Enumeration;"
            f" give it as a {variable.type}."
        )
    if (number := variable.item(text)) is not None:
        return number
    known = f"one of {', '.join(name for name, _ in variable.items)}" if variable.items else "its number"
    raise ParameterError(
        f"{file}: {variable.name!r} of {fmu.path.name} is an enumeration without an item {text!r}; give {known}."
    )
