"""Identified start values as files for other tools: SSV (System Structure and Parameterization) and Modelica."""

import json
import re
from pathlib import Path
from typing import Any

from thsa_cosim.errors import InputError
from thsa_cosim.fmu import FmuDescription
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


def write_identified_fmu(folder: Path, fmu: FmuDescription, parameters: ParameterSet) -> Path:
    """Export the FMU's model again with the identified start values, as ``<model>_identified.fmu``.

    The Modelica package is found by the ``manifest.json`` beside the FMU, which ``export`` keeps for shipped FMUs.

    Raises
    ------
    InputError
        If no manifest beside the FMU names it.
    MissingExtraError, ModelicaError
        As :func:`thsa_cosim.export.export_fmu`.
    """
    from thsa_cosim.export import export_fmu

    entry, package = _manifest_entry(fmu.path)
    path = folder / f"{fmu.path.stem}_identified.fmu"
    return export_fmu(
        str(entry["model"]),
        package=package,
        fmi=int(entry.get("fmi", 2)),
        output=path,
        start_values=parameters.values,
    )


def _manifest_entry(fmu: Path) -> tuple[dict[str, Any], Path]:
    for folder in fmu.resolve().parents[:2]:
        try:
            manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
            entries = {(folder / entry["file"]).resolve(): entry for entry in manifest["fmus"]}
            if fmu.resolve() in entries:
                return entries[fmu.resolve()], folder / manifest["package"]
        except (OSError, ValueError, KeyError, TypeError):
            continue
    raise InputError(
        f"{fmu} is not listed in a manifest.json in its folder, so its Modelica class is unknown; load"
        " identified.ssv into it instead."
    )
