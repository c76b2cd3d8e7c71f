"""A gain schedule for other tools: CSV, JSON, a C header and a Modelica block.

All of them interpolate linearly (bilinearly over two conditions) and hold the gains beyond the ends.
"""

import csv
import json
import re
from itertools import pairwise
from pathlib import Path

from thsa_cosim.signals import FloatArray
from thsa_cosim.tune import GainSchedule

NAME = "GainSchedule"


def write_schedule(folder: Path, schedule: GainSchedule, title: str) -> list[Path]:
    """Write ``schedule.csv``, ``schedule.json``, ``gain_schedule.h`` and ``GainSchedule.mo``; return the paths."""
    rows = schedule.points()
    table = folder / "schedule.csv"
    header = [
        *(f"{n} [{u}]" for n, u in zip(schedule.names, schedule.units, strict=True)),
        *(f"{n} [{schedule.gain_units[n]}]" for n in schedule.gains),
    ]
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows([[repr(v) for v in row.values()] for row in rows])
    plain = folder / "schedule.json"
    content = {
        "title": title,
        "interpolation": "linear, held beyond the ends",
        "conditions": [
            {"name": n, "unit": u, "nodes": x.tolist()}
            for n, u, x in zip(schedule.names, schedule.units, schedule.nodes, strict=True)
        ],
        "gains": {
            n: {"unit": schedule.gain_units[n], "values": v.tolist()} for n, v in schedule.gains.items()
        },
    }
    plain.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    code, model = folder / "gain_schedule.h", folder / f"{NAME}.mo"
    code.write_text(c_header(schedule, title), encoding="utf-8")
    model.write_text(modelica_block(schedule, title), encoding="utf-8")
    return [table, plain, code, model]


def identifier(name: str) -> str:
    """A name that C and Modelica accept."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if re.match(r"[A-Za-z_]", plain) else f"_{plain}"


def _numbers(values: FloatArray) -> str:
    return ", ".join(repr(float(v)) for v in values)


def c_header(schedule: GainSchedule, title: str) -> str:
    """C99: tables, a struct of the gains, and ``gain_schedule(...)``, which interpolates; no libraries needed."""
    names = [identifier(n) for n in schedule.names]
    gains = [identifier(n) for n in schedule.gains]
    comment = title.replace("*/", "* /")
    lines = [
        f"/* {comment}",
        "   Gains by linear interpolation between nodes, held beyond the ends. Written by thsa-cosim tune. */",
        "#ifndef GAIN_SCHEDULE_H",
        "#define GAIN_SCHEDULE_H",
        "",
        "typedef struct {",
        *(
            f"    double {g}; /* {schedule.gain_units[n]} */"
            for g, n in zip(gains, schedule.gains, strict=True)
        ),
        "} gain_schedule_t;",
        "",
    ]
    for name, unit, nodes in zip(names, schedule.units, schedule.nodes, strict=True):
        lines += [
            f"/* {unit} */",
            f"static const double gain_schedule_{name}[{nodes.size}] = {{{_numbers(nodes)}}};",
        ]
    for gain, values in zip(gains, schedule.gains.values(), strict=True):
        lines.append(
            f"static const double gain_schedule_{gain}[{values.size}] = {{{_numbers(values.ravel())}}};"
        )
    lines += [
        "",
        "/* Interval below x and the share of it, within the table. */",
        "static inline int gain_schedule_find(const double *nodes, int count, double x, double *share) {",
        "    int k = 0;",
        "    if (!(x > nodes[0])) { *share = 0.0; return 0; }",
        "    if (x >= nodes[count - 1]) { *share = 1.0; return count - 2; }",
        "    while (x >= nodes[k + 1]) { ++k; }",
        "    *share = (x - nodes[k]) / (nodes[k + 1] - nodes[k]);",
        "    return k;",
        "}",
        "",
    ]
    arguments = ", ".join(f"double {n}" for n in names)
    lines += [f"static inline gain_schedule_t gain_schedule({arguments}) {{", "    gain_schedule_t g;"]
    for k, (name, nodes) in enumerate(zip(names, schedule.nodes, strict=True)):
        lines += [
            f"    double s{k};",
            f"    const int k{k} = gain_schedule_find(gain_schedule_{name}, {nodes.size}, {name}, &s{k});",
        ]
    for gain in gains:
        table = f"gain_schedule_{gain}"
        if len(names) == 1:
            lines.append(f"    g.{gain} = (1.0 - s0) * {table}[k0] + s0 * {table}[k0 + 1];")
        else:
            row = schedule.nodes[1].size
            low = f"(1.0 - s1) * {table}[{row} * k0 + k1] + s1 * {table}[{row} * k0 + k1 + 1]"
            high = f"(1.0 - s1) * {table}[{row} * (k0 + 1) + k1] + s1 * {table}[{row} * (k0 + 1) + k1 + 1]"
            lines.append(f"    g.{gain} = (1.0 - s0) * ({low}) + s0 * ({high});")
    lines += ["    return g;", "}", "", "#endif", ""]
    return "\n".join(lines)


def modelica_block(schedule: GainSchedule, title: str) -> str:
    """A self-contained Modelica block with one input per condition and one output per gain."""
    names = [identifier(n) for n in schedule.names]
    gains = [identifier(n) for n in schedule.gains]
    text = title.replace("\\", "\\\\").replace('"', '\\"')
    lines = [f'block {NAME} "{text}"']
    for name, unit in zip(names, schedule.units, strict=True):
        lines.append(f'  input Real {name}(unit="{unit}") "Condition";')
    for gain, name in zip(gains, schedule.gains, strict=True):
        lines.append(f'  output Real {gain}(unit="{_modelica_unit(schedule.gain_units[name])}") "Gain";')
    inner: list[str] = []
    equations: list[str] = []
    for gain, values in zip(gains, schedule.gains.values(), strict=True):
        if len(names) == 1:
            equations.append(
                f"  {gain} = {_piecewise(names[0], schedule.nodes[0], [repr(float(v)) for v in values])};"
            )
            continue
        rows = []
        for k, row in enumerate(values):
            part = f"{gain}_{k + 1}"
            inner.append(f'  Real {part} "{gain} at node {k + 1} of {names[0]}";')
            equations.append(
                f"  {part} = {_piecewise(names[1], schedule.nodes[1], [repr(float(v)) for v in row])};"
            )
            rows.append(part)
        equations.append(f"  {gain} = {_piecewise(names[0], schedule.nodes[0], rows)};")
    if inner:
        lines += ["protected", *inner]
    documentation = "Linear between the nodes, held beyond the ends. Written by thsa-cosim tune."
    lines += ["equation", *equations]
    lines += [f'  annotation(Documentation(info="<html><p>{documentation}</p></html>"));', f"end {NAME};", ""]
    return "\n".join(lines)


def _piecewise(x: str, nodes: FloatArray, values: list[str]) -> str:
    """An if-expression that is linear between nodes; ``values`` are numbers or names."""
    points = nodes.tolist()
    text = f"if {x} <= {points[0]!r} then {values[0]}"
    for (low, high), (a, b) in zip(pairwise(points), pairwise(values), strict=True):
        text += f"\n    elseif {x} <= {high!r} then {a} + ({b} - ({a}))*({x} - ({low!r}))/{high - low!r}"
    return text + f"\n    else {values[-1]}"


def _modelica_unit(unit: str) -> str:
    return {"A/(rad/s)": "A.s/rad"}.get(unit, unit)
