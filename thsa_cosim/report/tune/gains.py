"""A tuning's gains: what each set reaches against its limits, term by term, and over the sweep of a schedule."""

from collections.abc import Mapping

from thsa_cosim.report.folder import Json, Part
from thsa_cosim.report.parts.content import Block, Cell, Column, Section, Table
from thsa_cosim.report.parts.text import DASH, number, number_cell, text_cell


def gains(part: Part) -> Section | None:
    """Before, those to compare with, and after; None before anything was scored."""
    result = part.result or {}
    sets = gain_sets(result)
    if not sets:
        return None
    rows = [
        [
            text_cell(name),
            text_cell(unit),
            *(number_cell(s["gains"].get(name)) for s in sets.values()),
            text_cell(""),
        ]
        for name, unit in result.get("units", {}).items()
    ]
    rows.append(
        [text_cell("cost (equation 7)"), text_cell("1"), *(number_cell(s["cost"]) for s in sets.values())]
    )
    rows[-1].append(text_cell(""))
    rows += term_rows(result, sets, sets)
    columns = [Column("quantity", numeric=False), Column("unit", numeric=False)]
    columns += [*(Column(name) for name in sets), Column("limit", numeric=False)]
    where = "" if len(result.get("groups", [])) < 2 else ", worst over all conditions"
    note = "Red: beyond the limit." if any(not s["feasible"] for s in sets.values()) else ""
    blocks: list[Block] = [Table(f"Before and after{where}", columns, rows, note)]
    parts = {name: s["cost_terms"] for name, s in sets.items() if s.get("cost_terms")}
    if parts:
        blocks.append(_parts_table(parts))
    return Section(f"{part.prefix}gains", "Before and after", tuple(blocks))


def gain_sets(result: Json) -> dict[str, Json]:
    """The scored sets of gains by name, in the order in which they are shown."""
    sets = {"before": result.get("before"), **result.get("compare", {}), "after": result.get("after")}
    return {name: scored for name, scored in sets.items() if scored}


def limits_of(result: Json) -> dict[str, str]:
    """``≤ 0.4`` or ``≥ 60`` by the requirement's name, with "(soft)" where it may be broken."""
    found = {}
    for requirement in result.get("requirements", []):
        upper = "maximum" in requirement
        limit = requirement["maximum" if upper else "minimum"]
        soft = "" if requirement.get("hard", True) else " (soft)"
        found[requirement["metric"]] = f"{'≤' if upper else '≥'} {number(limit)}{soft}"
    return found


def term_label(name: str) -> str:
    """``rise time``, ``peak of i_q``."""
    metric, _, signal = name.partition(".")
    return metric.replace("_", " ") + (f" of {signal}" if signal else "")


def _term_cell(value: float | None, name: str, mark: str) -> Cell:
    """A term; a margin that nothing limits (its line is never crossed) is kept as null and shown as ∞."""
    if value is None and name.endswith("_margin") and mark == "good":
        return Cell("∞", float("inf"), mark)
    return number_cell(value, mark=mark)


def term_rows(result: Json, values: Mapping[str, Json], sets: Mapping[str, Json]) -> list[list[Cell]]:
    """One row per term: its value for every set, marked where it exceeds, and its limit."""
    limits, rows = limits_of(result), []
    for name, unit in result.get("term_units", {}).items():
        row = [text_cell(term_label(name)), text_cell(unit)]
        for key, scored in sets.items():
            beyond = (scored.get("excess") or {}).get(name) or 0.0
            mark = "bad" if beyond > 0.0 else "good" if name in limits else ""
            row.append(_term_cell(values[key].get(name), name, mark))
        row.append(text_cell(limits.get(name, DASH)))
        rows.append(row)
    return rows


def _parts_table(parts: Mapping[str, Json]) -> Table:
    columns = [Column("part of equation 7", numeric=False), *(Column(name) for name in parts)]
    names = list(dict.fromkeys(name for terms in parts.values() for name in terms))
    rows = [
        [text_cell(term_label(n)), *(number_cell(terms.get(n)) for terms in parts.values())] for n in names
    ]
    return Table("What the cost is made of", columns, rows)
