"""Parameter sets as SSV files: System Structure and Parameterization 1.0 (reading: 2.0, too).

Source: Modelica Association, *System Structure and Parameterization* 1.0 (2019), section 6, and its XSD.
"""

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from thsa_cosim.errors import ParameterError, UnitError
from thsa_cosim.units import base_exponents

SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
FLOATS = ("Real", "Float64", "Float32")
"""Real of SSP 1.0, and the types of FMI 3.0 that SSP 2.0 adds."""
_NUMBERS = (
    *FLOATS,
    "Integer",
    "Boolean",
    *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)),
)


@dataclass(frozen=True)
class ParameterSet:
    """FMU start values by variable name, each with its unit (``""``: none given)."""

    name: str
    values: Mapping[str, float]
    units: Mapping[str, str] = field(default_factory=dict)
    description: str = ""
    others: Mapping[str, str] = field(default_factory=dict)
    """Types of the values that are no numbers (String, Enumeration, Binary), by name."""
    texts: Mapping[str, str] = field(default_factory=dict)
    """Values of those that are a String or the name of an item of an Enumeration."""


def write_ssv(path: Path, parameters: ParameterSet) -> None:
    """Write ``parameters`` as an SSV 1.0 file, with every unit defined by its SI exponents.

    Raises
    ------
    ParameterError
        For a value that is not finite.
    UnitError
        For a unit that is unknown.
    """
    ET.register_namespace("ssv", SSV)
    ET.register_namespace("ssc", SSC)
    root = ET.Element(f"{{{SSV}}}ParameterSet", {"version": "1.0", "name": parameters.name})
    if parameters.description:
        root.set("description", parameters.description)
    root.set("generationTool", "thsa-cosim")
    listed = ET.SubElement(root, f"{{{SSV}}}Parameters")
    used: dict[str, None] = {}
    for name, value in parameters.values.items():
        if not math.isfinite(value):
            raise ParameterError(f"{path}: value of {name!r} is {value}; only finite values can be written.")
        real = ET.SubElement(ET.SubElement(listed, f"{{{SSV}}}Parameter", {"name": name}), f"{{{SSV}}}Real")
        real.set("value", repr(float(value)))
        if unit := parameters.units.get(name, ""):
            real.set("unit", unit)
            used[unit] = None
    if used:
        units = ET.SubElement(root, f"{{{SSV}}}Units")
        for unit in used:
            exponents, factor, offset = base_exponents(unit)
            attributes = {base: str(power) for base, power in exponents.items()}
            if factor != 1.0:
                attributes["factor"] = repr(factor)
            if offset != 0.0:
                attributes["offset"] = repr(offset)
            ET.SubElement(
                ET.SubElement(units, f"{{{SSC}}}Unit", {"name": unit}), f"{{{SSC}}}BaseUnit", attributes
            )
    ET.indent(root)
    ET.ElementTree(root).write(path, encoding="UTF-8", xml_declaration=True)


def read_ssv(path: Path) -> ParameterSet:
    """Read an SSV file (1.0 or 2.0); numbers and Boolean values come back as floats, the rest as ``texts``.

    Raises
    ------
    ParameterError
        If the file is missing, is no SSV file, or sets an array, a Binary, or nothing.
    """
    try:
        root = ET.parse(path).getroot()
    except OSError as error:
        raise ParameterError(f"{path}: cannot be read ({error.strerror or error}); check the path.") from None
    except (ET.ParseError, ValueError, LookupError) as error:
        raise ParameterError(f"{path}: is no XML file ({error}); give a .ssv file of SSP 1.0.") from None
    return parse_ssv(root, path)


def parse_ssv(root: ET.Element, path: Path | str) -> ParameterSet:
    """Read a ParameterSet element; ``path`` is what messages name. Raises as :func:`read_ssv` does."""
    parameters = parse_parameter_set(root, path)
    for name, kind in parameters.others.items():
        if name not in parameters.texts:
            raise ParameterError(
                f"{path}: parameter {name!r} holds {kind}; only numbers and texts can be set, so remove it."
            )
    for name, unit in parameters.units.items():
        _known_unit(path, name, unit)
    return parameters


def parse_parameter_set(root: ET.Element, path: Path | str) -> ParameterSet:
    """Read a ParameterSet element with all that it holds: units as they stand, what is no number as ``others``."""
    if root.tag != f"{{{SSV}}}ParameterSet":
        raise ParameterError(f"{path}: holds {root.tag!r}, not the ParameterSet of an SSP 1.0 .ssv file.")
    values: dict[str, float] = {}
    units: dict[str, str] = {}
    others: dict[str, str] = {}
    texts: dict[str, str] = {}
    items = _enumerations(root)
    for parameter in root.iterfind(f"{{{SSV}}}Parameters/{{{SSV}}}Parameter"):
        name = parameter.get("name", "")
        if name in values or name in others:
            raise ParameterError(f"{path}: parameter {name!r} is set twice; remove one.")
        child = next((e for e in parameter if e.tag.startswith(f"{{{SSV}}}")), None)
        kind = "nothing" if child is None else child.tag.removeprefix(f"{{{SSV}}}")
        given = "" if child is None else child.get("value", "")
        if child is not None and kind == "Enumeration" and (child.get("name", ""), given) in items:
            values[name] = items[child.get("name", ""), given]
            continue
        if child is None or kind not in _NUMBERS:
            others[name] = kind
            if child is not None and kind in ("String", "Enumeration") and "value" in child.attrib:
                texts[name] = given
            continue
        if len(given.split()) < 2:
            values[name] = _number(path, name, kind, given.strip())
        else:
            others[name] = "an array"
        if kind in FLOATS and child.get("unit"):
            units[name] = child.get("unit", "")
    return ParameterSet(root.get("name", ""), values, units, root.get("description", ""), others, texts)


def _enumerations(root: ET.Element) -> dict[tuple[str, str], float]:
    """Numbers of the items of the enumerations that the file itself defines, by (enumeration, item)."""
    return {
        (enumeration.get("name", ""), item.get("name", "")): float(item.get("value", ""))
        for enumeration in root.iterfind(f"{{{SSV}}}Enumerations/{{{SSC}}}Enumeration")
        for item in enumeration.iterfind(f"{{{SSC}}}Item")
        if item.get("value", "").lstrip("-").isdecimal()
    }


def _known_unit(path: Path | str, name: str, unit: str) -> None:
    try:
        base_exponents(unit)
    except UnitError as error:
        raise UnitError(f"{path}: parameter {name!r}: {error}") from None


def _number(path: Path | str, name: str, kind: str, text: str) -> float:
    if kind == "Boolean":
        if text not in ("true", "false", "1", "0"):
            raise ParameterError(f"{path}: parameter {name!r}: {text!r} is no Boolean; give true or false.")
        return float(text in ("true", "1"))
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ParameterError(f"{path}: parameter {name!r}: {text!r} is no finite number.")
    if kind not in FLOATS and not number.is_integer():
        raise ParameterError(f"{path}: parameter {name!r} is of type {kind}: {text!r} is no whole number.")
    return number
