"""Identified start values as files for other tools: SSV (System Structure and Parameterization) and Modelica."""

import re
from pathlib import Path

from thsa_cosim.ssv import ParameterSet, write_ssv


def write_parameter_set(folder: Path, parameters: ParameterSet) -> list[Path]:
    """Write ``identified.ssv`` and ``Identified.mo``; return their paths."""
    ssv, record = folder / "identified.ssv", folder / "Identified.mo"
    write_ssv(ssv, parameters)
    record.write_text(modelica_record(parameters), encoding="utf-8")
    return [ssv, record]


def modelica_record(parameters: ParameterSet, name: str = "Identified") -> str:
    """A Modelica record with one parameter per start value, named like the FMU's variable (quoted).

    Modelica 3.6, section 2.3.1: a quoted identifier may hold dots; apostrophe and backslash are escaped.
    """
    lines = [f"record {name} {_string(parameters.description or parameters.name)}"]
    for variable, value in parameters.values.items():
        unit = parameters.units.get(variable, "")
        declared = f"(unit={_string(unit)})" if unit else ""
        lines.append(f"  parameter Real {_identifier(variable)}{declared} = {value!r};")
    lines.append(f"end {name};")
    return "\n".join(lines) + "\n"


def _identifier(name: str) -> str:
    if re.fullmatch(r"[A-Za-z_]\w*", name):
        return name
    return "'" + name.replace("\\", "\\\\").replace("'", "\\'") + "'"


def _string(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
