"""C source of the derivatives of a merged system: Jacobians and directional derivatives through the connections."""

from collections.abc import Mapping

from thsa_cosim.export.merge_layout import Glue, prefix
from thsa_cosim.system.order import stages


def jacobian(glue: Glue) -> list[str]:
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
            f"    double a[{n_x * n_x + 1}] = {{0.0}}, b[{n_x * n_u + 1}] = {{0.0}};",
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


def directional(glue: Glue) -> list[str]:
    """Seeds go the way that values go."""
    shown, total = len(glue.outputs), glue.places.total
    sizes = ", ".join(
        f"dx{k}[{m.size('N_X') + 1}], dw{k}[{m.size('N_W') + 1}]" for k, m in enumerate(glue.members)
    )
    lines = [
        "int model_directional(POINT, const double *sx, const double *su, const double *sp,",
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
