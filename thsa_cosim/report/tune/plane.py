"""The plane of two gains: cost, where requirements break, the population's way, and the line it draws towards."""

import numpy as np

from thsa_cosim.report.folder import Json, Part
from thsa_cosim.report.parts import chart
from thsa_cosim.report.parts.chart import Chart, packed, plain
from thsa_cosim.report.parts.content import Block, Section, Text
from thsa_cosim.report.parts.convergence import part_evolutions
from thsa_cosim.report.parts.populations import Evolution
from thsa_cosim.report.parts.text import number, quantity
from thsa_cosim.report.tune.gains import gain_sets
from thsa_cosim.report.tune.responses import set_colours

#: Generations of which the population is drawn, as shares of the search.
SHOWN = (0.0, 0.15, 0.4, 1.0)


def plane(part: Part) -> Section | None:
    """The section; None unless two gains were searched (or the scenario asks for a plane)."""
    if part.journal is None:
        return None
    result = part.result or {}
    surface: Json | None = result.get("surface")
    names = list(surface["parameters"]) if surface else list(part.journal.names)
    found = part_evolutions(part)
    if len(names) != 2 or not found:
        return None
    units = result.get("units") or part.about.get("parameters", {})
    drawn = Chart(f"{part.prefix}surface", row_height=520)
    logarithmic = [_is_log(surface, found[0], k, name) for k, name in enumerate(names)]
    if surface:
        _draw_surface(drawn, surface)
    sets = gain_sets(result)
    colours = set_colours(sets)
    _draw_population(drawn, found[0], [part.journal.names.index(n) for n in names])
    for name, scored in sets.items():
        x, y = (float(scored["gains"][n]) for n in names)
        symbol = "star" if name == "after" else "diamond"
        colour = colours[name]
        drawn.points(
            [x], [y], name, size=14, colour=colour, symbol=symbol, edge=1.5, edge_colour="var(--paper)"
        )
    line: Json | None = result.get("line")
    corners = _corners(surface, found[0], [part.journal.names.index(n) for n in names])
    if line:
        _draw_line(drawn, line, names, corners)
    drawn.axes(x=f"{names[0]} [{units.get(names[0], '1')}]", y=f"{names[1]} [{units.get(names[1], '1')}]")
    spans = [np.log10(c) if is_log else np.array(c) for c, is_log in zip(corners, logarithmic, strict=True)]
    drawn.axes(log_x=logarithmic[0], log_y=logarithmic[1], dtick_x="D2", dtick_y="D2")
    drawn.axes(x_range=spans[0].tolist(), y_range=spans[1].tolist())
    figure = drawn.build(f"The plane of {names[0]} and {names[1]}: {found[0].label}.")
    blocks: tuple[Block, ...] = (Text(_line_sentence(line)), figure) if line else (figure,)
    return Section(f"{part.prefix}plane", f"Plane of {names[0]} and {names[1]}", blocks)


def _line_sentence(line: Json) -> str:
    ratio = f"{line['numerator']}/{line['denominator']}"
    text = (
        f"Over the last {line['generations']} generations the population lies at {ratio} = {number(line['ratio'])}"
        f" (middle half {number(line['low'])} to {number(line['high'])})"
    )
    return text + (f"; published: {number(line['published'])}." if line.get("published") else ".")


def _is_log(surface: Json | None, evolution: Evolution, column: int, name: str) -> bool:
    """Whether a gain is searched on a logarithmic scale: told from the map's steps, else from the span."""
    if surface:
        x = np.array(surface[name], dtype=np.float64)
        return bool(x[0] > 0.0 and np.ptp(np.diff(np.log(x))) < np.ptp(np.diff(x)))
    values = evolution.populations[0][:, column]
    return bool(np.nanmin(values) > 0.0 and np.nanmax(values) > 30.0 * np.nanmin(values))


def _corners(surface: Json | None, evolution: Evolution, columns: list[int]) -> list[tuple[float, float]]:
    if surface:
        return [(float(surface[n][0]), float(surface[n][-1])) for n in surface["parameters"]]
    first = evolution.populations[0][:, columns]
    spans = [chart.limits([first[:, k]]) or (0.0, 1.0) for k in range(2)]
    return [(max(low, float(np.nanmin(first[:, k])) / 1.2), high) for k, (low, high) in enumerate(spans)]


def _draw_surface(drawn: Chart, surface: Json) -> None:
    x_name, y_name = surface["parameters"]
    eq7 = np.array(
        [[np.nan if v is None else v for v in row] for row in surface["equation_7"]], dtype=np.float64
    )
    cost = np.array([[np.nan if v is None else v for v in row] for row in surface["cost"]], dtype=np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        level = np.log10(np.where(eq7 > 0.0, eq7, np.nan))
    place = {"x": packed(surface[x_name]), "y": packed(surface[y_name])}
    drawn.add(
        0,
        0,
        "",
        type="contour",
        **place,
        z=packed(level),
        ncontours=24,
        colorscale="Viridis",
        reversescale=True,
        line={"width": 0},
        colorbar={
            "title": {"text": "log₁₀ of equation 7 [1]", "side": "right", "font": {"size": 13}},
            "len": 0.9,
        },
        hovertemplate=f"{plain(x_name)} %{{x:.4g}}<br>{plain(y_name)} %{{y:.4g}}<br>log₁₀ %{{z:.4g}}<extra></extra>",
    )
    broken = np.where(np.isfinite(cost), 0.0, 1.0)
    if broken.any():
        drawn.add(
            0,
            0,
            "breaks a hard requirement",
            type="contour",
            **place,
            z=packed(broken),
            # Plotly fills where the constraint does not hold.
            contours={"type": "constraint", "operation": "<", "value": 0.5},
            fillcolor="rgba(60, 60, 60, 0.5)",
            line={"width": 1, "color": "rgb(40, 40, 40)"},
            showscale=False,
            hoverinfo="skip",
        )


def _draw_population(drawn: Chart, evolution: Evolution, columns: list[int]) -> None:
    last = len(evolution.populations) - 1
    shown = dict.fromkeys(round(share * last) for share in SHOWN)
    shades = ("#ffffff", "#ffd9a0", "#ff9d3c", "#e03b00")
    for k, shade in zip(shown, shades, strict=False):
        at = evolution.populations[k][:, columns]
        name = f"generation {k}"
        drawn.points(at[:, 0], at[:, 1], name, size=7, colour=shade, edge=0.8, edge_colour="#333333")


def _draw_line(drawn: Chart, line: Json, names: list[str], corners: list[tuple[float, float]]) -> None:
    if {line["numerator"], line["denominator"]} != set(names):
        return
    x = np.geomspace(max(corners[0][0], 1e-12), corners[0][1], 60)
    upright = line["numerator"] == names[0]
    ratio = f"{line['numerator']}/{line['denominator']}"
    for value, dash, label in (
        (line["ratio"], "solid", "last generations"),
        (line.get("published"), "dot", "published"),
    ):
        if value:
            y = x / value if upright else x * value
            drawn.line(
                x, y, f"{ratio} = {quantity(value, '')} ({label})", colour="var(--ink)", dash=dash, width=1.4
            )
