"""What the command line prints at the end of an identification (rich)."""

import math
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from thsa_cosim.identify.off_published import KIND as OFF_PUBLISHED
from thsa_cosim.identify.results import ForceBalance, IdentifyResult, LawResult, PointResult
from thsa_cosim.inspection import Inspection
from thsa_cosim.report.identify.doubts import LawDoubts, doubt_sentences
from thsa_cosim.report.inspection import print_inspection, print_trust
from thsa_cosim.report.parts.text import number, percent
from thsa_cosim.report.simulate.tables import error_cells


def print_identify(console: Console, result: IdentifyResult) -> None:
    """Print laws, points and errors of an identification."""
    if result.laws:
        console.print(laws_table(result))
        for sentence in doubt_sentences({name: _law_doubts(law) for name, law in result.laws.items()}):
            console.print(Text(sentence), highlight=False)
    console.print(points_table(result))
    for sentence in search_sentences(result.points):
        console.print(Text(sentence), highlight=False)
    if any(result.errors.values()):
        console.print(errors_table(result))
    if result.force is not None:
        console.print(Text(force_sentence(result.force)), highlight=False)
    print_trust(console, result.trust)
    # Found by the fit, and no reason against it: nothing has printed them yet.
    print_inspection(console, Inspection.of(f for f in result.data.findings if f.kind == OFF_PUBLISHED))
    for note in result.notes:
        console.print(Text(f"note: {note}"), highlight=False)


def search_sentences(points: Sequence[PointResult]) -> list[str]:
    """How many local searches agreed: one sentence where it is the same at all points, else one for each kind."""
    ended: dict[str, list[str]] = {}
    for point in points:
        if point.local:
            ended.setdefault(point.stopped, []).append(point.label)
    if len(ended) == 1 and len(points) > 1:
        return [f"At every point {sentence}." for sentence in ended]
    return [f"{', '.join(labels)}: {sentence}." for sentence, labels in ended.items()]


def laws_table(result: IdentifyResult) -> Table:
    """Identified laws compared with the published ones."""
    table = Table(title="Laws over temperature (t in °C)", title_justify="left")
    for heading in ("parameter", "unit", "form", "identified", "published"):
        table.add_column(heading, overflow="fold")
    table.add_column("largest deviation\nof the points", justify="right")
    table.add_column("of the law", justify="right")
    for name, law in result.laws.items():
        published = law.published
        table.add_row(
            Text(name),
            Text(law.unit),
            law.law.form + (" (chosen)" if law.selected else ""),
            ", ".join(number(c, 3) for c in law.law.coefficients),
            "–" if published is None else ", ".join(number(c, 3) for c in published.coefficients),
            percent(law.deviation) if law.determined else "not determined",
            percent(law.law_deviation) if law.determined else "–",
        )
    return table


def _law_doubts(law: LawResult) -> LawDoubts:
    return LawDoubts(
        [(d.kind, d.severity, d.text) for d in law.doubts],
        [(d.kind, d.severity, d.text) for d in law.published_doubts],
    )


def points_table(result: IdentifyResult) -> Table:
    """Every parameter at every point with its standard error; values in brackets are not determined."""
    names = list(result.points[0].parameters) if result.points else []
    table = Table(title="Identified values ± one standard error", title_justify="left")
    table.add_column("point")
    for name in names:
        unit = result.points[0].parameters[name].unit
        table.add_column(Text(f"{name} [{unit}]"), justify="right")
    table.add_column("cost per sample", justify="right")
    for point in result.points:
        cells = []
        for name in names:
            estimate = point.parameters[name]
            text = f"{number(estimate.value)} ± {number(estimate.stderr, 2)}"
            cells.append(text if estimate.identifiable else f"({text})")
        table.add_row(Text(point.label), *cells, number(point.cost_per_sample))
    reasons = [reason for name in names if (reason := _why_not(result, name))]
    if reasons:
        table.caption = "In brackets: not determined by these data.\n" + "\n".join(reasons)
        table.caption_justify = "left"
    return table


def _why_not(result: IdentifyResult, name: str) -> str:
    """Why ``name`` is not determined, for one point or for several at once; empty if it is."""
    unsure = [
        (p.label, p.parameters[name].reason) for p in result.points if not p.parameters[name].identifiable
    ]
    if not unsure:
        return ""
    label, reason = unsure[0]
    where = label if len(unsure) == 1 else f"{len(unsure)} of {len(result.points)} points, as {label}"
    return f"{name} at {where}: {reason}"


def errors_table(result: IdentifyResult) -> Table:
    """Rmse against noise per channel, for the fitted and the held-out recordings."""
    table = Table(title="Simulated against measured", title_justify="left")
    for heading in ("recordings", "signal"):
        table.add_column(heading)
    for heading in ("rmse", "noise", "rmse / noise", "rmse / range"):
        table.add_column(heading, justify="right")
    for role, channels in result.errors.items():
        for name, error in channels.items():
            table.add_row(role, Text(name), *error_cells(error))
    return table


def force_sentence(force: ForceBalance) -> str:
    """The force residual by role, with the differences between laps."""
    by_role = ", ".join(f"{number(rms, 3)} {force.unit} ({role})" for role, rms in force.rms.items())
    laps = (
        ""
        if math.isnan(force.repeatability)
        else f"; laps differ by {number(force.repeatability, 2)} {force.unit}"
    )
    return f"Force residual below {force.band:g} Hz: {by_role}{laps}."
