"""A variable of an FMU as a frozen object, and how it is read: of all that ``modelDescription.xml`` holds, most."""

from dataclasses import dataclass, replace
from typing import Any
from xml.etree import ElementTree

import numpy as np

FLOAT_TYPES = ("Real", "Float64", "Float32")
INTEGERS = tuple(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64))
NUMBERS = (*FLOAT_TYPES, *INTEGERS, "Integer", "Boolean", "Enumeration")
_ABSOLUTE_ZERO = {"K": 0.0, "degC": -273.15, "degF": -459.67}


@dataclass(frozen=True)
class Variable:
    """One variable of an FMU; numbers are in ``unit``, ``None`` where the description is silent."""

    name: str
    value_reference: int
    causality: str
    """parameter, calculatedParameter, input, output, local, independent, structuralParameter"""
    variability: str
    """constant, fixed, tunable, discrete, continuous"""
    type: str
    """Real, Integer, Boolean, String, Enumeration (FMI 1 and 2); Float64, Int32, ... (FMI 3)"""
    unit: str | None = None
    start: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    description: str = ""
    is_array: bool = False
    intermediate_update: bool = False
    """FMI 3: may be set inside a communication step (clause 4.2.2)."""
    initial: str | None = None
    """exact, approx, calculated"""
    element: tuple[int, int, int] | None = None
    """FMI 3, one element of an array: value reference, index and length of the array; ``value_reference`` is then a
    number of our own. The array itself has its entry, but is no input, output or parameter."""
    is_negated: bool = False
    """FMI 1: an alias of the other sign; the FMU sets and gets the variable that it stands for."""
    is_alias: bool = False
    """FMI 3: another name of a variable that has its own entry."""
    items: tuple[tuple[str, int], ...] = ()
    """Names and numbers of an enumeration, in the order of its type definition."""

    @property
    def is_scalar(self) -> bool:
        """Whether it is a number of its own: no second name, and no array, whose elements are numbers."""
        return not self.is_alias and not (self.is_array and self.type in NUMBERS)

    @property
    def is_float(self) -> bool:
        """Whether the value is a floating-point number."""
        return self.type in FLOAT_TYPES

    @property
    def takes_start(self) -> bool:
        """Whether a local variable or an output, such as a state, takes a start value (FMI 2.0.4, clause 2.2.7)."""
        started = self.causality in ("local", "output") and self.initial in ("exact", "approx")
        return started and self.variability != "constant"

    @property
    def may_stay_open(self) -> bool:
        """Whether it is an input that needs no signal: a temperature that starts below absolute zero."""
        zero = _ABSOLUTE_ZERO.get(self.unit or "")
        return self.causality == "input" and None not in (zero, self.start) and self.start < zero  # type: ignore[operator]

    def item(self, text: str) -> float | None:
        """Number of the item of an enumeration that ``text`` names, or gives as a number; None if there is none."""
        named = dict(self.items)
        if text in named:
            return float(named[text])
        try:
            given = int(text)
        except ValueError:
            return None
        return float(given) if not named or given in named.values() else None


def read_variables(raw: Any, xml: bytes) -> dict[str, Variable]:
    """All variables by name; arrays as their elements, in row-major order: ``A[1,1]``, ``A[1,2]``, ...

    ``raw``: fmpy's description; ``xml``: the file, for what fmpy does not read of it.
    """
    intermediate = _intermediate_variables(xml)
    found: dict[str, Variable] = {}
    virtual = 0
    for one in raw.modelVariables:
        variable = _variable(one, intermediate)
        shape = _shape(one, raw)
        found[variable.name] = variable
        if shape is None or variable.type not in NUMBERS:
            continue
        size = int(np.prod(shape))
        starts = str(one.start or "").split()
        for index in range(size):
            where = ",".join(str(int(i) + 1) for i in np.unravel_index(index, shape))
            start = starts[index] if index < len(starts) else starts[0] if len(starts) == 1 else None
            found[f"{variable.name}[{where}]"] = replace(
                variable,
                name=f"{variable.name}[{where}]",
                value_reference=virtual,
                start=read_number(start),
                is_array=False,
                intermediate_update=False,
                element=(variable.value_reference, index, size),
            )
            virtual += 1
    return _negated(found, xml)


def _negated(variables: dict[str, Variable], xml: bytes) -> dict[str, Variable]:
    """Mark FMI 1.0's negated aliases, which fmpy does not read."""
    if b"negatedAlias" not in xml:
        return variables
    elements = ElementTree.fromstring(xml).findall("ModelVariables/ScalarVariable")
    names = {e.get("name") for e in elements if e.get("alias") == "negatedAlias"}
    return {n: replace(v, is_negated=n in names) for n, v in variables.items()}


def _shape(one: Any, raw: Any) -> tuple[int, ...] | None:
    """Lengths of an array's dimensions, which may be structural parameters' start values; None for a scalar."""
    if not one.dimensions:
        return None
    starts = {int(v.valueReference): v.start for v in raw.modelVariables}
    lengths = []
    for dimension in one.dimensions:
        length = dimension.start
        if length is None:
            variable = getattr(dimension, "variable", None)
            length = starts.get(int(dimension.valueReference)) if variable is None else variable.start
        lengths.append(int(length or 0))
    return tuple(lengths)


def count_numbers(unknowns: Any, raw: Any) -> int:
    """How many numbers the variables of a list are together."""
    shapes = [_shape(unknown.variable, raw) for unknown in unknowns]
    return sum(1 if shape is None else int(np.prod(shape)) for shape in shapes)


def _variable(raw: Any, intermediate: set[int]) -> Variable:
    declared = raw.declaredType

    def attribute(name: str) -> Any:
        own = getattr(raw, name)
        return own if own is not None else getattr(declared, name, None)

    return Variable(
        name=raw.name,
        value_reference=int(raw.valueReference),
        causality=raw.causality or "local",
        variability=raw.variability or "continuous",
        type=raw.type,
        unit=attribute("unit"),
        start=read_number(raw.start),
        minimum=read_number(attribute("min")),
        maximum=read_number(attribute("max")),
        nominal=read_number(attribute("nominal")),
        description=raw.description or "",
        is_array=bool(raw.dimensions),
        intermediate_update=int(raw.valueReference) in intermediate,
        initial=raw.initial,
        is_alias=raw.alias is not None,
        items=_items(declared) if raw.type == "Enumeration" else (),
    )


def _items(declared: Any) -> tuple[tuple[str, int], ...]:
    """Items of an enumeration's type; those of FMI 1.0 count from 1."""
    listed = getattr(declared, "items", None) or ()
    return tuple(
        (item.name, k if item.value is None else int(item.value)) for k, item in enumerate(listed, 1)
    )


def _intermediate_variables(xml: bytes) -> set[int]:
    """Value references that FMI 3 allows in Intermediate Update Mode; fmpy does not read that attribute."""
    if b"intermediateUpdate" not in xml:
        return set()
    root = ElementTree.fromstring(xml)
    variables = root.findall("ModelVariables/*")
    return {
        int(v.attrib["valueReference"]) for v in variables if v.get("intermediateUpdate") in ("true", "1")
    }


def read_number(text: Any) -> float | None:
    """Read a number or an FMI boolean; ``None`` for anything else (strings, arrays)."""
    if text is None:
        return None
    if text in ("true", "false"):
        return float(text == "true")
    try:
        return float(text)
    except ValueError:
        return None
