"""The trade-off between two terms of a tuning: the gains that were tried, and the Pareto front."""

from thsa_cosim.report.folder import Json, Part
from thsa_cosim.report.parts import chart
from thsa_cosim.report.parts.chart import Chart
from thsa_cosim.report.parts.content import Block, Column, Fold, Section, Table
from thsa_cosim.report.parts.text import number_cell
from thsa_cosim.report.tune.gains import term_label
from thsa_cosim.tune.combine import INFEASIBLE
from thsa_cosim.tune.problem import ALL


def pareto(part: Part) -> Section | None:
    """The trade-off between two terms; None where the scenario asks for none."""
    result = part.result or {}
    content: Json | None = result.get("pareto")
    if not content or not content["front"]:
        return None
    x_name, y_name = content["x"], content["y"]
    units: Json = result.get("term_units", {})
    labels = [f"{term_label(n)} [{units.get(n, '1')}]" for n in (x_name, y_name)]
    drawn = Chart(f"{part.prefix}pareto", row_height=360)
    tried = _tried(part, x_name, y_name)
    if tried is not None:
        drawn.points(*tried, "tried and feasible", colour=chart.MEASURED, size=4, edge=0)
    front = sorted(content["front"], key=lambda row: float(row[x_name]))
    x, y = [row[x_name] for row in front], [row[y_name] for row in front]
    drawn.points(x, y, "Pareto front", joined=True, colour=chart.SIMULATED, size=7)
    drawn.axes(x=labels[0], y=labels[1])
    gain_units: Json = result.get("units", {})
    columns = [Column(term_label(n), units.get(n, "1")) for n in (x_name, y_name)]
    columns += [Column(n, u) for n, u in gain_units.items()]
    rows = [[number_cell(row[key]) for key in (x_name, y_name, *gain_units)] for row in front]
    table = Table("Pareto-optimal gains", columns, rows)
    blocks: tuple[Block, ...] = (
        drawn.build(
            "Each point is one set of gains that meets every hard requirement. On the Pareto front neither term"
            " can be improved without making the other one worse."
        ),
        Fold(f"{len(rows)} Pareto-optimal sets of gains", (table,)),
    )
    return Section(f"{part.prefix}pareto", "Trade-off", blocks)


def _tried(part: Part, x_name: str, y_name: str) -> tuple[list[float], list[float]] | None:
    """All feasible gains of the journal in two terms."""
    journal = part.journal
    if journal is None or not {x_name, y_name} <= set(journal.terms):
        return None
    i, j = journal.terms.index(x_name), journal.terms.index(y_name)
    rows = [row for row in journal.rows if row.stage == ALL and row.cost < INFEASIBLE]
    return [row.terms[i] for row in rows], [row.terms[j] for row in rows]
