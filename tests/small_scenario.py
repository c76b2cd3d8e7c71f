"""A small valid scenario, its recordings and its FMU (a description without binary), for tests of loading."""

import copy
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.fmu import FmuDescription, read_description

VARIABLES = [
    ("w_cmd", "input", "continuous", 'unit="rad/s" start="0"'),
    ("T_amb", "input", "continuous", 'unit="degC" start="25"'),
    ("w_m", "output", "continuous", 'unit="rad/s"'),
    ("i_q", "output", "continuous", 'unit="A"'),
    ("flux", "local", "continuous", ""),
    ("motor.R_s.a0", "parameter", "fixed", 'unit="Ohm" start="1.2" min="0" max="100"'),
    ("motor.R_s.a1", "parameter", "fixed", 'unit="Ohm/K" start="0.03"'),
    ("motor.R_s.a2", "parameter", "fixed", 'unit="Ohm/K2" start="7e-5"'),
    ("motor.J", "parameter", "fixed", 'unit="kg.m2" start="2e-3"'),
    ("motor.gain", "parameter", "fixed", 'start="1"'),
    ("velocityController.K_p", "parameter", "tunable", 'unit="A.s/rad" start="0.1" min="0"'),
    ("velocityController.K_i", "parameter", "tunable", 'unit="A/rad" start="0.4" min="0"'),
]


def model_description() -> str:
    """FMI 2.0 Co-Simulation description with the variables above."""
    rows = []
    for k, (name, causality, variability, attributes) in enumerate(VARIABLES, start=1):
        initial = ' initial="exact"' if causality == "parameter" else ""
        rows.append(
            f'<ScalarVariable name="{name}" valueReference="{k}" causality="{causality}"'
            f' variability="{variability}"{initial} description="about {name}"><Real {attributes}/></ScalarVariable>'
        )
    units = {a.split('unit="')[1].split('"')[0] for *_, a in VARIABLES if "unit=" in a}
    definitions = "".join(f'<Unit name="{unit}"/>' for unit in sorted(units))
    outputs = "".join(f'<Unknown index="{k}"/>' for k, v in enumerate(VARIABLES, start=1) if v[1] == "output")
    return (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="2.0" modelName="Small"'
        ' guid="{1}" generationTool="test"><CoSimulation modelIdentifier="Small"/>'
        f"<UnitDefinitions>{definitions}</UnitDefinitions><ModelVariables>{''.join(rows)}</ModelVariables>"
        f"<ModelStructure><Outputs>{outputs}</Outputs></ModelStructure></fmiModelDescription>"
    )


def write_fmu(path: Path) -> FmuDescription:
    """Write the archive and return its description."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", model_description())
    return read_description(path)


def write_recording(path: Path, temperature: float, seed: int = 0) -> None:
    """Write a CSV of 50 samples with noise on its measured columns."""
    rng = np.random.default_rng(seed)
    time = np.arange(50) * 0.01
    speed = np.round(10 * np.sin(time) + rng.normal(0, 0.2, 50), 2)
    current = np.round(np.cos(time) + rng.normal(0, 0.05, 50), 3)
    cold = np.round(temperature + rng.normal(0, 0.2, 50), 1)
    rows = np.column_stack([time, 10.0 * (time > 0.1), speed, current, cold])
    np.savetxt(
        path, rows, delimiter=",", header="time,command,speed,current,temperature", comments="", fmt="%.6g"
    )


VALID: dict[str, Any] = {
    "kind": "identify",
    "title": "small",
    "fmu": "Small.fmu",
    "seed": 3,
    "recordings": {
        "fit": ["runs/cold_*.csv", "runs/warm.csv"],
        "validate": ["runs/check.csv"],
        "time": {"column": "time", "unit": "s"},
        "columns": {
            "w_cmd": {"column": "command", "unit": "rad/s", "interpolation": "hold"},
            "T_amb": {"column": "temperature", "unit": "degC", "smooth": "mean"},
            "w_m": {"column": "speed", "unit": "rad/s"},
            "i_q": {"column": "current", "unit": "A"},
        },
    },
    "temperature": {"input": "T_amb", "round_to": 1.0},
    "fixed": {"velocityController.K_p": 0.12},
    "parameters": [
        {
            "name": "R_s",
            "variable": "motor.R_s.a0",
            "law_block": "motor.R_s",
            "unit": "ohm",
            "lower": 0.05,
            "upper": 5.0,
            "start": 1.0,
            "law": {"form": "linear", "published": [1.2, 0.03]},
        },
        {"name": "J", "variable": "motor.J", "unit": "g.m2", "lower": 0.1, "upper": 10.0, "scale": "log"},
    ],
    "cost": {
        "error": "squared",
        "channels": {"i_q": {"weight": 2.0, "noise": "estimate"}, "w_m": {"noise": 0.2}},
        "window": {"start": 0.0, "stop": 0.4},
        "mask": [[0.1, 0.12]],
    },
    "search": {"population": 20, "generations": 5, "strategy": "best1bin"},
    "simulation": {"tolerance": 1e-6, "deadline": 10.0},
}


def valid() -> dict[str, Any]:
    """Return a deep copy of the valid scenario."""
    return copy.deepcopy(VALID)


def set_in(data: dict[str, Any], dotted: str, value: Any) -> dict[str, Any]:
    """Set ``parameters/0/lower`` or the like; ``...`` as value deletes."""
    *parents, last = [int(p) if p.isdigit() else p for p in dotted.split("/")]
    here: Any = data
    for part in parents:
        here = here[part]
    if value is ...:
        del here[last]
    else:
        here[last] = value
    return data


def toml(data: dict[str, Any]) -> str:
    """Return TOML text: one line per top-level key, inline tables below."""
    return "".join(f"{_text(key)} = {_value(value)}\n" for key, value in data.items())


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_text(k)} = {_value(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, int | float) else value.isoformat()


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def write_folder(folder: Path) -> FmuDescription:
    """Write FMU and recordings under ``folder``: -30 degC twice, 25 degC, and one to validate at -30 degC."""
    (folder / "runs").mkdir(parents=True)
    for k, (name, temperature) in enumerate(
        [("cold_1", -30), ("cold_2", -30.2), ("warm", 25), ("check", -29.8)]
    ):
        write_recording(folder / "runs" / f"{name}.csv", temperature, seed=k)
    return write_fmu(folder / "Small.fmu")
