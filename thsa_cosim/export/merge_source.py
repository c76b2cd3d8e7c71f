"""C source that joins the models of several of our FMUs into one model: what the runtime's ``model.h`` asks for.

Each component's ``model.c`` is compiled as it is, under other names; the code here places the pieces in common vectors
(x, u, p, d, w, g one component after the other) and follows the connections: v holds the inputs of all components.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from thsa_cosim.system.order import stages
from thsa_cosim.system.structure import System

_FUNCTIONS = (
    "dependent", "initial", "rhs", "algebraic", "outputs", "indicators", "jacobian", "directional", "time_slopes",
    "p_start", "u_start", "x_start", "x_nominal", "p_tunable",
)  # fmt: skip
_POINT = "double t, const double *x, const double *u, const double *p, const double *d, const double *m"


@dataclass(frozen=True)
class Member:
    """One component's generated C and its sizes."""

    name: str
    model: str
    """Text of its ``model.c``."""
    config: Mapping[str, float]
    """The numbers of its ``model_config.h``: N_X, VR_X, …"""
    references: Mapping[str, int]
    """Value references of its variables."""
    feedthrough: Mapping[str, tuple[str, ...] | None]
    inputs: tuple[str, ...]
    """Names of its inputs in the order of its u."""
    states: tuple[str, ...]
    """Names of its states in the order of its x."""

    def size(self, what: str) -> int:
        """One of the sizes, e.g. N_X."""
        return int(self.config.get(what, 0))

    def place(self, name: str) -> tuple[str, int] | None:
        """Group ("X", "W", …) and index of a variable; None for one that has no place of its own."""
        reference = self.references[name]
        for group, size in (("X", "N_X"), ("DX", "N_X"), ("U", "N_U"), ("P", "N_P"), ("W", "N_W")):
            index = reference - self.size(f"VR_{group}")
            if 0 <= index < self.size(size):
                return group, index
        return None

    def source(self, name: str) -> tuple[str, int] | None:
        """("X", k) for what equals a state, ("W", k) for an output; None for anything else."""
        found = self.place(name)
        if found is None or found[0] == "X":
            return found
        group, index = found
        if group != "W" or index >= self.size("N_Y"):
            return None
        body = self.model.split("int model_outputs(", 1)[1].split("\n}\n", 1)[0]
        same = re.search(rf"^\s*y\[{index}\] = x\[(\d+)\];$", body, re.M)
        return ("X", int(same[1])) if same else (group, index)


@dataclass(frozen=True)
class Layout:
    """Where each component's pieces lie: first index of every group by component, and the totals."""

    first: Mapping[str, Mapping[str, int]]
    total: Mapping[str, int]


def layout(members: Sequence[Member]) -> Layout:
    """Place x, inputs v, p, d with cache, outputs y, other variables w, g one after the other."""
    sizes = {
        member.name: {
            "X": member.size("N_X"),
            "V": member.size("N_U"),
            "P": member.size("N_P"),
            "D": member.size("N_D") + member.size("N_CACHE"),
            "Y": member.size("N_Y"),
            "W": member.size("N_W") - member.size("N_Y"),
            "G": member.size("N_G"),
        }
        for member in members
    }
    first: dict[str, dict[str, int]] = {member.name: {} for member in members}
    total = dict.fromkeys("XVPDYWG", 0)
    for group in total:
        for member in members:
            first[member.name][group] = total[group]
            total[group] += sizes[member.name][group]
    return Layout(first, total)


def prefix(index: int) -> str:
    """Prefix of a component's C names."""
    return f"c{index}_"


def member_source(index: int) -> str:
    """A translation unit that compiles one component's ``model.c`` under names of its own."""
    lines = [f"#define model_{name} {prefix(index)}{name}" for name in _FUNCTIONS]
    return "\n".join([*lines, f'#include "c{index}/model.c"', ""])


@dataclass(frozen=True)
class Glue:
    """A merged system: its components, the connections in terms of C, and the connectors."""

    system: System
    members: tuple[Member, ...]
    places: Layout
    inputs: tuple[tuple[str, tuple[tuple[int, float, float], ...]], ...]
    """External inputs: name and ((index into v, factor, offset), …)."""
    outputs: tuple[tuple[str, tuple[str, str], float, float], ...]
    """Output connectors: name, (component, variable), factor, offset."""

    def number(self, name: str) -> int:
        """Position of a component."""
        return next(k for k, member in enumerate(self.members) if member.name == name)

    def pin(self, name: str, variable: str) -> int:
        """Index into v of a component's input."""
        member = self.members[self.number(name)]
        return self.places.first[name]["V"] + member.inputs.index(variable)


def merged_source(glue: Glue) -> str:
    """Text of the merged ``model.c``."""
    parts = [
        "/* Generated by thsa-cosim: the models of a system of FMUs as one. */",
        "#include <math.h>",
        "#include <string.h>",
        '#include "model.h"',
        "",
        *_declarations(glue),
        f"#define POINT {_POINT}",
        *_local(glue),
        *_connect(glue),
        *_simple(glue),
        *_initial(glue),
        *_variables(glue),
        *_jacobian(glue),
        *_directional(glue),
        *_tables(glue),
    ]
    return "\n".join(parts) + "\n"


def _declarations(glue: Glue) -> list[str]:
    lines = []
    for k in range(len(glue.members)):
        c = prefix(k)
        lines += [
            f"int {c}dependent(const double *p, double *d);",
            f"int {c}initial(double t, const double *u, const double *p, const double *d, const double *m,"
            " const double *x_start, double *x);",
            f"int {c}jacobian({_POINT}, double *A, double *B, double *ft);",
            f"int {c}directional({_POINT}, const double *sx, const double *su, const double *sp,"
            " double *ddx, double *dw);",
            *(
                f"int {c}{name}({_POINT}, double *out);"
                for name in ("rhs", "algebraic", "outputs", "indicators")
            ),
        ]
    return lines


def _local(glue: Glue) -> list[str]:
    """A macro for each component: its own slice of the point, with v in place of u."""
    lines = []
    for k, member in enumerate(glue.members):
        at = glue.places.first[member.name]
        lines.append(
            f"#define AT{k} t, x + {at['X']}, v + {at['V']}, p + {at['P']}, d + {at['D']}, m + {at['G']}"
        )
    return [*lines, ""]


def _value(glue: Glue, pin: tuple[str, str]) -> str:
    """C expression of a source once its component's outputs are known (y<k>)."""
    member = glue.members[glue.number(pin[0])]
    found = member.source(pin[1])
    assert found is not None
    if found[0] == "X":
        return f"x[{glue.places.first[pin[0]]['X'] + found[1]}]"
    return f"y{glue.number(pin[0])}[{found[1]}]"


def _scaled(text: str, factor: float, offset: float) -> str:
    scaled = text if factor == 1.0 else f"{factor!r} * {text}"
    return scaled if offset == 0.0 else f"{scaled} + {offset!r}"


def _connect(glue: Glue) -> list[str]:
    """v from u and the connections, in the order of direct feed-through."""
    lines = [
        "/* Inputs of all components. */",
        "static int connect(POINT, double *v) {",
        "  (void)t; (void)x; (void)u; (void)p; (void)d; (void)m;",
    ]
    for index, (_, driving) in enumerate(glue.inputs):
        lines += [f"  v[{at}] = {_scaled(f'u[{index}]', factor, offset)};" for at, factor, offset in driving]
    driven = {pin for _, pins in glue.inputs for pin, *_ in pins}
    fed = {glue.pin(*c.target) for c in glue.system.connections}
    lines += [f"  v[{pin}] = 0.0;" for pin in range(glue.places.total["V"]) if pin in fed - driven]
    for stage in stages(glue.system):
        for name in dict.fromkeys(pin[0] for pin in stage.sources):
            k = glue.number(name)
            pins = [pin for pin in stage.sources if pin[0] == name]
            needed = any(_value(glue, pin).startswith("y") for pin in pins)
            lines.append("  {")
            if needed:
                lines += [
                    f"    double y{k}[{max(1, glue.members[k].size('N_Y'))}];",
                    f"    if ({prefix(k)}outputs(AT{k}, y{k})) return 1;",
                ]
            for connection in glue.system.connections:
                if connection.source in pins:
                    value = _scaled(_value(glue, connection.source), connection.factor, connection.offset)
                    lines.append(f"    v[{glue.pin(*connection.target)}] = {value};")
            lines.append("  }")
    return [*lines, "  return 0;", "}", ""]


def _simple(glue: Glue) -> list[str]:
    """dependent, rhs, indicators: each component's own, into its slice."""
    v = f"double v[{glue.places.total['V'] + 1}]"
    lines = ["int model_dependent(const double *p, double *d) {", "  (void)p; (void)d;"]
    for k, member in enumerate(glue.members):
        at = glue.places.first[member.name]
        if member.size("N_D") + member.size("N_CACHE"):
            lines.append(f"  if ({prefix(k)}dependent(p + {at['P']}, d + {at['D']})) return 1;")
    lines += ["  return 0;", "}", ""]
    for name, group in (("rhs", "X"), ("indicators", "G")):
        lines += [
            f"int model_{name}(POINT, double *out) {{",
            f"  {v};",
            "  if (connect(t, x, u, p, d, m, v)) return 1;",
        ]
        for k, member in enumerate(glue.members):
            lines.append(
                f"  if ({prefix(k)}{name}(AT{k}, out + {glue.places.first[member.name][group]})) return 1;"
            )
        lines += ["  return 0;", "}", ""]
    return lines


def _initial(glue: Glue) -> list[str]:
    """Initial equations of one component may need outputs of another: repeated until nothing changes."""
    lines = [
        "int model_initial(double t, const double *u, const double *p, const double *d, const double *m,",
        "                  const double *x_start, double *x) {",
        f"  double v[{glue.places.total['V'] + 1}], before[N_X + 1];",
        "  memcpy(x, x_start, sizeof(double) * N_X);",
        "  for (int i = 0; i < 100; i++) {",
        "    int changed = 0;",
        "    memcpy(before, x, sizeof(double) * N_X);",
        "    if (connect(t, x, u, p, d, m, v)) return 1;",
    ]
    for k, member in enumerate(glue.members):
        at = glue.places.first[member.name]
        lines.append(
            f"    if ({prefix(k)}initial(t, v + {at['V']}, p + {at['P']}, d + {at['D']}, m + {at['G']},"
            f" x_start + {at['X']}, x + {at['X']})) return 1;"
        )
    return [
        *lines,
        "    for (int k = 0; k < N_X; k++) changed |= fabs(x[k] - before[k]) > 1e-14 * (fabs(x[k]) + 1e-300);",
        "    if (!changed) return 0;",
        "  }",
        "  return 1;",
        "}",
        "",
    ]


def _variables(glue: Glue) -> list[str]:
    """outputs and algebraic: connectors, outputs of all components, their other variables, connected inputs."""
    shown, total = len(glue.outputs), glue.places.total
    lines = []
    for name in ("outputs", "algebraic"):
        lines += [
            f"int model_{name}(POINT, double *w) {{",
            f"  double v[{total['V'] + 1}];",
            "  if (connect(t, x, u, p, d, m, v)) return 1;",
        ]
        for k, member in enumerate(glue.members):
            at, n_y = glue.places.first[member.name], member.size("N_Y")
            if name == "outputs":
                lines += [
                    f"  double *y{k} = w + {shown + at['Y']}; (void)y{k};",
                    f"  if ({prefix(k)}outputs(AT{k}, y{k})) return 1;" if n_y else "",
                ]
                continue
            lines += [
                f"  double y{k}[{member.size('N_W') + 1}];",
                f"  if ({prefix(k)}algebraic(AT{k}, y{k})) return 1;",
                f"  memcpy(w + {shown + at['Y']}, y{k}, sizeof(double) * {n_y});",
                f"  memcpy(w + {shown + total['Y'] + at['W']}, y{k} + {n_y},"
                f" sizeof(double) * {member.size('N_W') - n_y});",
            ]
        for index, (_, pin, factor, offset) in enumerate(glue.outputs):
            lines.append(f"  w[{index}] = {_scaled(_value(glue, pin), factor, offset)};")
        if name == "algebraic":
            lines.append(
                f"  memcpy(w + {shown + total['Y'] + total['W']}, v, sizeof(double) * {total['V']});"
            )
        lines += ["  return 0;", "}", ""]
    return [line for line in lines if line != ""] + [""]


def _jacobian(glue: Glue) -> list[str]:
    """A + B G (gradients of the sources): each source's gradient by x and u follows the order of the stages."""
    rows = {pin: index for index, pin in enumerate(dict.fromkeys(c.source for c in glue.system.connections))}
    feeds = {c.target: c for c in glue.system.connections}
    outside = {pin: (k, f) for k, (_, pins) in enumerate(glue.inputs) for pin, f, _ in pins}
    lines = [
        "int model_jacobian(POINT, double *A, double *B, double *ft) {",
        f"  double v[{glue.places.total['V'] + 1}], r[{len(rows) + 1}][N_X + N_U + 1];",
        "  if (connect(t, x, u, p, d, m, v)) return 1;",
        "  memset(A, 0, sizeof(double) * N_X * N_X);",
        "  memset(B, 0, sizeof(double) * N_X * N_U);",
        "  memset(r, 0, sizeof r);",
    ]
    for stage in stages(glue.system):
        for pin in stage.sources:
            lines += _gradient(glue, pin, rows, feeds, outside)
    for k, member in enumerate(glue.members):
        n_x, n_u, at = member.size("N_X"), member.size("N_U"), glue.places.first[member.name]
        lines += [
            "  {",
            f"    double a[{n_x * n_x + 1}], b[{n_x * n_u + 1}];",
            f"    if ({prefix(k)}jacobian(AT{k}, a, b, ft + {at['X']})) return 1;",
            f"    for (int j = 0; j < {n_x}; j++)",
            f"      for (int i = 0; i < {n_x}; i++) A[(j + {at['X']}) * N_X + i + {at['X']}] += a[j * {n_x} + i];",
        ]
        for j, name in enumerate(member.inputs):
            loop = f"    for (int i = 0; i < {n_x}; i++) "
            target = (member.name, name)
            if target in feeds:
                gain, row = feeds[target].factor, rows[feeds[target].source]
                lines += [
                    f"{loop}{{",
                    f"      const double slope = {gain!r} * b[{j * n_x} + i];",
                    f"      for (int c = 0; c < N_X; c++) A[c * N_X + i + {at['X']}] += slope * r[{row}][c];",
                    f"      for (int c = 0; c < N_U; c++) B[c * N_X + i + {at['X']}] += slope * r[{row}][N_X + c];",
                    "    }",
                ]
            elif glue.pin(*target) in outside:
                column, factor = outside[glue.pin(*target)]
                lines.append(f"{loop}B[{column} * N_X + i + {at['X']}] += {factor!r} * b[{j * n_x} + i];")
        lines.append("  }")
    return [*lines, "  return 0;", "}", ""]


def _gradient(
    glue: Glue,
    pin: tuple[str, str],
    rows: Mapping[tuple[str, str], int],
    feeds: Mapping[tuple[str, str], object],
    outside: Mapping[int, tuple[int, float]],
) -> list[str]:
    """Lines that fill r[row of the source] with its gradient by x and u."""
    k = glue.number(pin[0])
    member, at, row = glue.members[k], glue.places.first[pin[0]], rows[pin]
    found = member.source(pin[1])
    assert found is not None
    if found[0] == "X":
        return [f"  r[{row}][{at['X'] + found[1]}] = 1.0;"]
    known = member.feedthrough.get(pin[1])
    names = (*member.states, *member.inputs) if known is None else known
    lines = [
        "  {",
        f"    double sx[{member.size('N_X') + 1}] = {{0.0}}, su[{member.size('N_U') + 1}] = {{0.0}},"
        f" sp[{member.size('N_P') + 1}] = {{0.0}}, dx[{member.size('N_X') + 1}], dw[{member.size('N_W') + 1}];",
    ]
    for name in names:
        seed = f"sx[{member.states.index(name)}]" if name in member.states else None
        if name in member.inputs:
            seed = f"su[{member.inputs.index(name)}]"
        if seed is None:
            continue
        lines += [
            f"    {seed} = 1.0;",
            f"    if ({prefix(k)}directional(AT{k}, sx, su, sp, dx, dw)) return 1;",
            f"    {seed} = 0.0;",
        ]
        slope = f"dw[{found[1]}]"
        if name in member.states:
            lines.append(f"    r[{row}][{at['X'] + member.states.index(name)}] += {slope};")
            continue
        target = (member.name, name)
        connection = next((c for c in glue.system.connections if c.target == target), None)
        if connection is not None:
            source = rows[connection.source]
            lines += [
                "    for (int c = 0; c < N_X + N_U; c++)",
                f"      r[{row}][c] += {connection.factor!r} * {slope} * r[{source}][c];",
            ]
        elif (index := glue.pin(*target)) in outside:
            column, factor = outside[index]
            lines.append(f"    r[{row}][N_X + {column}] += {factor!r} * {slope};")
    return [*lines, "  }"]


def _directional(glue: Glue) -> list[str]:
    """Seeds go the way that values go."""
    shown, total = len(glue.outputs), glue.places.total
    sizes = ", ".join(
        f"dx{k}[{m.size('N_X') + 1}], dw{k}[{m.size('N_W') + 1}]" for k, m in enumerate(glue.members)
    )
    lines = [
        f"int model_directional({_POINT}, const double *sx, const double *su, const double *sp,",
        "                      double *ddx, double *dw) {",
        f"  double v[{total['V'] + 1}], sv[{total['V'] + 1}] = {{0.0}}, {sizes};",
        "  if (connect(t, x, u, p, d, m, v)) return 1;",
    ]
    for index, (_, driving) in enumerate(glue.inputs):
        lines += [f"  sv[{at}] = {factor!r} * su[{index}];" for at, factor, _ in driving]

    def call(k: int) -> str:
        at = glue.places.first[glue.members[k].name]
        seeds = f"sx + {at['X']}, sv + {at['V']}, sp + {at['P']}"
        return f"  if ({prefix(k)}directional(AT{k}, {seeds}, dx{k}, dw{k})) return 1;"

    def moved(pin: tuple[str, str]) -> str:
        found = glue.members[glue.number(pin[0])].source(pin[1])
        assert found is not None
        return (
            f"sx[{glue.places.first[pin[0]]['X'] + found[1]}]"
            if found[0] == "X"
            else f"dw{glue.number(pin[0])}[{found[1]}]"
        )

    for stage in stages(glue.system):
        for name in dict.fromkeys(pin[0] for pin in stage.sources):
            pins = [pin for pin in stage.sources if pin[0] == name]
            if any(moved(pin).startswith("dw") for pin in pins):
                lines.append(call(glue.number(name)))
            lines += [
                f"  sv[{glue.pin(*c.target)}] = {c.factor!r} * {moved(c.source)};"
                for c in glue.system.connections
                if c.source in pins
            ]
    for k, member in enumerate(glue.members):
        at, n_y = glue.places.first[member.name], member.size("N_Y")
        lines += [
            call(k),
            f"  memcpy(ddx + {at['X']}, dx{k}, sizeof(double) * {member.size('N_X')});",
            f"  memcpy(dw + {shown + at['Y']}, dw{k}, sizeof(double) * {n_y});",
            f"  memcpy(dw + {shown + total['Y'] + at['W']}, dw{k} + {n_y},"
            f" sizeof(double) * {member.size('N_W') - n_y});",
        ]
    lines += [
        f"  dw[{index}] = {factor!r} * {moved(pin)};"
        for index, (_, pin, factor, _) in enumerate(glue.outputs)
    ]
    lines.append(f"  memcpy(dw + {shown + total['Y'] + total['W']}, sv, sizeof(double) * {total['V']});")
    return [*lines, "  return 0;", "}", ""]


def table(member: Member, name: str) -> list[float]:
    """One of a component's tables of start values, read from its source."""
    found = re.search(rf"model_{name}\[\] = \{{([^}}]*)\}};", member.model)
    assert found is not None, name
    size = {"p_start": "N_P", "p_tunable": "N_P", "u_start": "N_U"}.get(name, "N_X")
    return [float(number.strip(" ()")) for number in found[1].split(",")][: member.size(size)]


def _tables(glue: Glue) -> list[str]:
    given = {component.name: component.start for component in glue.system.components}
    lines = []
    for name, group in (("p_start", "P"), ("x_start", "X"), ("x_nominal", None)):
        values: list[float] = []
        for member in glue.members:
            own = table(member, name)
            for variable, value in given[member.name].items():
                place = member.place(variable)
                if group is not None and place is not None and place[0] == group:
                    own[place[1]] = float(value)
            values += own
        lines.append(f"const double model_{name}[] = {{{', '.join(repr(v) for v in values or [0.0])}}};")
    tunable = [int(flag) for member in glue.members for flag in table(member, "p_tunable")]
    lines.append(f"const unsigned char model_p_tunable[] = {{{', '.join(map(str, tunable or [0]))}}};")
    starts = [repr(start) for start in input_starts(glue)]
    lines.append(f"const double model_u_start[] = {{{', '.join(starts or ['0.0'])}}};")
    return lines


def input_starts(glue: Glue) -> list[float]:
    """Start values of the external inputs, from those of the first input that each drives."""
    starts: list[float] = []
    inner = [value for member in glue.members for value in table(member, "u_start")]
    for component in glue.system.components:
        for variable, value in component.start.items():
            if variable in glue.members[glue.number(component.name)].inputs:
                inner[glue.pin(component.name, variable)] = float(value)
    for _, pins in glue.inputs:
        pin, factor, offset = pins[0]
        starts.append((inner[pin] - offset) / factor)
    return starts
