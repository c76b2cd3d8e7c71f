"""Identified parameters: points with intervals, fitted and published laws, over temperature."""

import numpy as np

from thsa_cosim.laws import Law
from thsa_cosim.report.folder import Json
from thsa_cosim.report.identify.doubts import LawDoubts, doubt_sentences
from thsa_cosim.report.parts import chart
from thsa_cosim.report.parts.chart import Chart
from thsa_cosim.report.parts.content import Block, Cell, Column, Figure, Section, Table, Text
from thsa_cosim.report.parts.text import DASH, bound_text, degrees, number, percent, plus_minus, text_cell


def parameters(result: Json, prefix: str = "") -> Section | None:
    """The section of ``points`` and ``laws``; None without a point."""
    points: list[Json] = result.get("points", [])
    if not points:
        return None
    blocks: list[Block] = []
    laws: Json = result.get("laws", {})
    if laws:
        blocks.append(_laws_table(laws))
        blocks += [
            Text(sentence[0].upper() + sentence[1:], "bad" if sentence.startswith("warning") else "")
            for sentence in doubt_sentences({name: LawDoubts.read(law) for name, law in laws.items()})
        ]
    blocks.append(_points_table(points))
    title = "Parameters over temperature" if laws else "Parameters"
    return Section(f"{prefix}parameters", title, tuple(blocks))


def laws_figure(result: Json, prefix: str = "") -> Figure | None:
    """All laws with the points that they go through; None without a law."""
    points, laws = result.get("points", []), result.get("laws", {})
    return _figure(points, laws, prefix) if points and laws else None


def read_law(content: Json) -> Law:
    """A law as ``result.json`` holds it."""
    covariance = content.get("covariance")
    return Law(
        content["form"],
        tuple(content["coefficients"]),
        tuple(content.get("knots", ())),
        None if covariance is None else np.array(covariance, dtype=np.float64),
    )


def _names(points: list[Json]) -> list[str]:
    return list(dict.fromkeys(name for point in points for name in point["parameters"]))


def _figure(points: list[Json], laws: Json, prefix: str) -> Figure:
    columns = min(2, len(laws))
    rows = -(-len(laws) // columns)
    drawn = Chart(f"{prefix}laws", rows=rows, columns=columns, row_height=260)
    for k, (name, content) in enumerate(laws.items()):
        at = divmod(k, columns)
        own = [p for p in points if p["temperature_degC"] is not None and name in p["parameters"]]
        _draw_law(drawn, at, name, content, own)
        drawn.axes(*at, x="temperature [°C]", y=f"{name} [{content['unit']}]")
    return drawn.build(
        "Identified values with 95 % intervals, the fitted law with its 95 % band, the published law."
    )


def law_figures(result: Json, prefix: str = "") -> list[Figure]:
    """Every law alone, for those who want one picture each."""
    figures = []
    for name, content in result.get("laws", {}).items():
        drawn = Chart(f"{prefix}law-{name}", row_height=340)
        own = [
            p
            for p in result.get("points", [])
            if p["temperature_degC"] is not None and name in p["parameters"]
        ]
        _draw_law(drawn, (0, 0), name, content, own)
        drawn.axes(x="temperature [°C]", y=f"{name} [{content['unit']}]")
        figures.append(
            drawn.build("Identified values with 95 % intervals, the fitted law, the published law.")
        )
    return figures


def _draw_law(drawn: Chart, at: tuple[int, int], name: str, content: Json, points: list[Json]) -> None:
    law = read_law(content)
    t = np.array([p["temperature_degC"] for p in points], dtype=np.float64)
    found = [p["parameters"][name] for p in points]
    values = np.array([e["value"] for e in found], dtype=np.float64)
    errors = 1.96 * np.array([e["stderr"] or 0.0 for e in found], dtype=np.float64)
    sure = np.array([bool(e["identifiable"]) for e in found], dtype=bool)
    cold, warm = content.get("between") or (float(t.min()) - 2.0, float(t.max()) + 2.0)
    grid = np.linspace(cold, warm, 200)
    curve, band = law(grid), 1.96 * law.stderr(grid)
    published = content.get("published")
    if np.isfinite(band).all():
        drawn.band(grid, curve - band, curve + band, "95 % of the fitted law", at=at)
    drawn.line(grid, curve, "fitted law", at=at, colour=chart.SIMULATED, width=2)
    if published is not None:
        drawn.line(
            grid,
            read_law(published)(grid),
            "published",
            at=at,
            colour=chart.PUBLISHED,
            dash="dash",
            width=1.6,
        )
    for chosen, label, symbol in (
        (sure, "identified", "circle"),
        (~sure, "not determined by the data", "circle-open"),
    ):
        if chosen.any():
            drawn.points(t[chosen], values[chosen], label, at=at, error=errors[chosen], symbol=symbol, size=6)
    # A band or bar that dwarfs everything else would leave nothing to see.
    shown = [values, values[sure] + errors[sure], values[sure] - errors[sure], curve]
    if published is not None:
        shown.append(read_law(published)(grid))
    span = chart.limits(shown)
    if span is not None:
        drawn.axes(*at, y_range=span)
    form = content["form"] + ("" if content.get("identifiable", True) else ", not determined by the data")
    drawn.title(f"{name}: {form}", *at)


def _laws_table(laws: Json) -> Table:
    columns = (
        Column("parameter", numeric=False),
        Column("unit", numeric=False),
        Column("form", numeric=False),
        Column("coefficients identified", numeric=False),
        Column("published", numeric=False),
        Column("largest deviation of the points"),
        Column("of the law"),
    )
    rows = []
    for name, law in laws.items():
        published, away = law.get("published"), law.get("largest_deviation") or {}
        chosen = " (chosen by AICc)" if law.get("selected_by") == "aicc" else ""
        determined = law.get("identifiable", True)
        rows.append(
            (
                text_cell(name),
                text_cell(law["unit"]),
                text_cell(law["form"] + chosen),
                text_cell(_coefficients(law)),
                text_cell(DASH if published is None else _coefficients(published)),
                *(_deviations(away) if determined else (Cell("not determined", None, "bad"), Cell(DASH))),
            )
        )
    note = (
        "t in °C. Polynomials from α0 up; exponentials α1, β1, α2, β2. Deviations are relative to the published"
        " curve's largest value."
    )
    return Table("Laws over temperature", columns, rows, note)


def _deviations(away: Json) -> tuple[Cell, Cell]:
    """Largest deviations from the published curve: of the points, and of the law."""
    points, law = away.get("points"), away.get("law")
    return Cell(percent(points), points), Cell(percent(law), law)


def _coefficients(law: Json) -> str:
    return ", ".join(number(c, 3) for c in law["coefficients"])


def _points_table(points: list[Json]) -> Table:
    names = _names(points)
    units = {n: next(p["parameters"][n]["unit"] for p in points if n in p["parameters"]) for n in names}
    columns = (Column("temperature"), *(Column(name, units[name]) for name in names))
    rows, unsure = [], False
    for point in points:
        row = [Cell(degrees(point["temperature_degC"]), point["temperature_degC"])]
        for name in names:
            estimate = point["parameters"].get(name)
            if estimate is None:
                row.append(Cell(DASH))
                continue
            sure = estimate["identifiable"]
            unsure = unsure or not sure
            text = plus_minus(estimate["value"], estimate["stderr"])
            on_bound = bound_text(estimate)
            text += f" {on_bound}" if on_bound else ""
            sure = sure and not on_bound
            row.append(Cell(text if sure else f"({text})", estimate["value"], "" if sure else "bad"))
        rows.append(row)
    note = "In brackets: not determined by these data. " + _reasons(points) if unsure else ""
    return Table("Identified values ± one standard error", columns, rows, note)


def _reasons(points: list[Json]) -> str:
    """Why values are not determined, one sentence per parameter."""
    reasons = []
    for name in _names(points):
        found = [(p["temperature_degC"], p["parameters"][name]) for p in points if name in p["parameters"]]
        unsure = [(t, e) for t, e in found if not e["identifiable"]]
        if unsure:
            where = degrees(unsure[0][0]) if len(unsure) == 1 else f"{len(unsure)} of {len(found)} points"
            reasons.append(f"{name} ({where}): {unsure[0][1].get('reason', '')}.")
    return " ".join(reasons)
