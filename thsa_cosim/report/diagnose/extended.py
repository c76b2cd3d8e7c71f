"""The extended model as a scenario of its own: the same machine, identified again from other recordings.

``thsa-cosim identify STUDY/extended.toml --fit ... -o B`` fits the declared parameters and the coefficients of the
effects that the diagnosis found, so that ``thsa-cosim compare`` can say what changed in the machine since.
"""

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from thsa_cosim.diagnosis.results import DiagnosisResult, Value
from thsa_cosim.errors import UnitError
from thsa_cosim.fmu import read_description
from thsa_cosim.units import convert

EXTENDED = "extended.toml"
#: A coefficient may become this many times as large as its effect is now.
ROOM = 5.0
_HEADING = """\
# The model with the effects that this diagnosis found, to be identified from other recordings of the machine:
# thsa-cosim identify {path} --fit FILE --validate FILE -o AFTER; thsa-cosim compare {folder} AFTER
"""
_LISTS = ("fit", "validate")


def write_extended_scenario(result: DiagnosisResult, folder: Path) -> Path | None:
    """Write ``extended.toml`` into ``folder``; None if no effect was found, or the model is a wrapper around an FMU."""
    if result.extended_fmu is None or not result.effects or not result.asked:
        return None
    home = result.scenario.parent
    asked = {key: value for key, value in result.asked.items() if key not in ("diagnose", "kind", "fmu")}
    asked = {"kind": "identify", "fmu": result.extended_fmu.name, **asked}
    asked["title"] = f"{result.title}, with {', '.join(e.name for e in result.effects)}"
    recordings = dict(asked.get("recordings", {}))
    for role in _LISTS:
        if role in recordings:
            recordings[role] = [_seen_from(folder, home / name) for name in recordings[role]]
    asked["recordings"] = recordings
    if "parameter_set" in asked:
        asked["parameter_set"] = _seen_from(folder, home / asked["parameter_set"])
    files = {n: v for n, v in asked.get("fixed", {}).items() if isinstance(v, Mapping)}
    moved = {n: {"file": _seen_from(folder, home / v["file"])} for n, v in files.items()}
    asked["fixed"] = {**asked.get("fixed", {}), **moved}
    asked["parameters"] = [
        *(_declared(p, result.declared_after.get(p["name"])) for p in asked["parameters"]),
        *_coefficients(result, result.extended_fmu),
    ]
    values = [v for _, parameters in _kept(result) for v in parameters.values()]
    asked["fixed"] = {**asked.get("fixed", {}), **{v.variable: v.value for v in values if v.role == "shape"}}
    path = folder / EXTENDED
    text = _HEADING.format(path=path, folder=folder) + "\n".join(_tables(asked, ()))
    path.write_text(text.rstrip() + "\n", encoding="utf-8")
    return path


def _seen_from(folder: Path, path: Path) -> str:
    try:
        return Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()
    except ValueError:  # another drive of Windows
        return path.absolute().as_posix()


def _declared(parameter: Mapping[str, Any], found: Value | None) -> dict[str, Any]:
    """The parameter with what was found as its start, where its unit allows that."""
    own = {key: value for key, value in parameter.items() if key != "spread"}
    if found is not None:
        try:
            value = float(convert(found.value, found.unit, own["unit"]))
        except UnitError:
            return own
        own.pop("start", None)
        if own["lower"] < value < own["upper"]:
            own["start"] = value
    return own


def _kept(result: DiagnosisResult) -> list[tuple[str, Mapping[str, Value]]]:
    """Name and parameters of every effect in the model, known or found."""
    known = [(e.name, e.parameters) for e in result.known]
    return known + [(e.name, e.parameters) for e in result.effects]


def _coefficients(result: DiagnosisResult, fmu: Path) -> Iterator[dict[str, Any]]:
    """The effects' coefficients; their shapes (wave numbers, speeds) stay as they were found."""
    variables = read_description(fmu).variables
    for effect, parameters in _kept(result):
        values = {n: v for n, v in parameters.items() if v.role == "coefficient"}
        sizes: dict[str, float] = {}
        for v in values.values():
            sizes[v.unit] = max(sizes.get(v.unit, 0.0), abs(v.value))
        for name, v in values.items():
            room, known = ROOM * (sizes[v.unit] or 1.0), variables[v.variable]
            yield {
                "name": f"{effect}.{name}",
                "variable": v.variable,
                "unit": v.unit,
                "start": v.value,
                "lower": -room if known.minimum is None else max(-room, known.minimum),
                "upper": room if known.maximum is None else min(room, known.maximum),
            }


def _tables(content: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    """Lines of TOML: plain values first, then tables, then lists of tables."""
    inner = {k: v for k, v in content.items() if isinstance(v, Mapping)}
    rows = {k: v for k, v in content.items() if isinstance(v, list) and v and isinstance(v[0], Mapping)}
    for key, value in content.items():
        if key not in inner and key not in rows and value is not None:
            yield f"{_key(key)} = {_value(value)}"
    yield ""
    for key, table in inner.items():
        if any(not isinstance(v, Mapping) for v in table.values()) or not table:
            yield f"[{'.'.join(map(_key, (*path, key)))}]"
        yield from _tables(table, (*path, key))
    for key, tables in rows.items():
        for table in tables:
            yield f"[[{'.'.join(map(_key, (*path, key)))}]]"
            yield from _tables(table, (*path, key))


def _key(name: str) -> str:
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else _text(name)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    return _text(str(value))


def _text(value: str) -> str:
    """A basic string of TOML, whose escapes are those of JSON."""
    return json.dumps(value, ensure_ascii=False)
