"""A diagnosis: the verdict with the effects it names, and whether they help on recordings that no fit has seen."""

from thsa_cosim.report.page.chart import AFTER, BEFORE, Chart
from thsa_cosim.report.page.comparison import noise_ratio, ratio_mark, recording_folds, role_text
from thsa_cosim.report.page.content import Block, Cell, Column, Facts, Figure, Section, Table, Text
from thsa_cosim.report.page.folder import Json, Part
from thsa_cosim.report.page.text import (
    DASH,
    listing,
    number_cell,
    percent,
    plus_minus,
    significant_cell,
    text_cell,
)
from thsa_cosim.report.signal_files import read_signals, signal_paths, signal_units

_VERDICTS = {
    "missing-effect": "The model lacks {effects}: added to it, the error on held-out recordings falls.",
    "no-missing-effect": "The model lacks nothing that these recordings show: what is left is noise, or declared"
    " parameters that were tuned again.",
    "unexplained-structure": "Something repeatable is left that no effect of the catalogue explains; see on what it"
    " depends.",
}


def verdict(result: Json) -> tuple[Block, ...]:
    """What the summary says first: the verdict, and each effect with its parameters."""
    word = str(result["verdict"])
    effects: list[Json] = result.get("effects", [])
    names = listing([e["name"] for e in effects])
    sentence = _VERDICTS.get(word, word).format(effects=names)
    if word == "unexplained-structure" and effects:
        sentence += f" What was found all the same: {names}."
    blocks: list[Block] = [Text(sentence, "good" if word == "no-missing-effect" else "bad")]
    if effects:
        blocks.append(_effects_table(effects))
    left = result.get("unexplained")
    if left is not None:
        blocks.append(Text(f"{percent(left)} of the repeatable residual is left unexplained."))
    alike = [f"{e['name']} from {listing(e['equivalent'])}" for e in effects if e.get("equivalent")]
    if alike:
        blocks.append(Text(f"These recordings cannot tell {listing(alike)}."))
    experiment = _experiment(result.get("experiment"))
    if experiment:
        blocks.append(Facts(experiment))
    return tuple(blocks)


def before_after(part: Part) -> Section | None:
    """Errors of the declared and the extended model, as multiples of the noise; None before the end."""
    result = part.result or {}
    rows: list[tuple[str, str, Json, Json]] = []
    for role in ("fit", "validate"):
        before, after = result.get("before", {}).get(role, {}), result.get("after", {}).get(role, {})
        rows += [(role, channel, error, after.get(channel, {})) for channel, error in before.items()]
    if not rows:
        return None
    columns = [Column(text, numeric=False) for text in ("recordings", "signal", "unit")]
    columns += [
        Column(text) for text in ("rmse before", "after", "noise (1 σ)", "before / noise", "after / noise")
    ]
    units = signal_units(part.folder)
    table = []
    for role, channel, before, after in rows:
        ratios = [noise_ratio(error) if error else None for error in (before, after)]
        cells = (before.get("rmse"), after.get("rmse"), before.get("noise"))
        table.append(
            (
                text_cell(role_text(role)),
                text_cell(channel),
                text_cell(before.get("unit") or units.get(channel, "")),
                *(significant_cell(v) for v in cells),
                *(significant_cell(ratio, 3, ratio_mark(ratio)) for ratio in ratios),
            )
        )
    note = "Before: the declared model, its parameters identified again. After: the extended model likewise."
    blocks = (_ratios_figure(part, rows), Table("Errors before and after", columns, table, note))
    return Section(f"{part.prefix}before-after", "Before and after", blocks)


def recordings(part: Part) -> Section | None:
    """Measured, before and after, for every recording and channel."""
    found = [read_signals(path) for path in signal_paths(part.folder)]
    if not found:
        return None
    return Section(f"{part.prefix}signals", "Measured against simulated", tuple(recording_folds(part, found)))


def candidates(part: Part) -> Section | None:
    """Every effect that was weighed, and those that these recordings cannot test."""
    result = part.result or {}
    weighed, skipped = result.get("candidates", []), result.get("not_testable", [])
    blocks: list[Block] = []
    if weighed:
        blocks.append(_candidates_table(weighed))
    if skipped:
        pairs = [(s["name"], s.get("reason", "")) if isinstance(s, dict) else (s, "") for s in skipped]
        rows = [tuple(map(text_cell, pair)) for pair in pairs]
        columns = (Column("effect", numeric=False), Column("why not", numeric=False))
        blocks.append(Table("Effects that these recordings cannot test", columns, rows))
    return Section(f"{part.prefix}candidates", "Effects that were weighed", tuple(blocks)) if blocks else None


def _effects_table(effects: list[Json]) -> Table:
    columns = [Column("effect", numeric=False), Column("probability"), Column("parameter", numeric=False)]
    columns += [Column("value"), Column("unit", numeric=False), Column("cannot be told from", numeric=False)]
    rows = []
    for effect in effects:
        likely, alike = effect.get("probability"), listing(effect.get("equivalent") or [])
        named = [text_cell(effect["name"]), Cell(percent(likely, 3), likely)]
        if not effect.get("parameters"):
            rows.append((*named, text_cell(DASH), Cell(DASH), text_cell(""), text_cell(alike)))
        for name, value in effect.get("parameters", {}).items():
            text = plus_minus(value["value"], value.get("stderr"))
            own = (text_cell(name), Cell(text, value["value"]), text_cell(value.get("unit", "")))
            rows.append((*named, *own, text_cell(alike)))
    return Table("What came out: effects with their parameters ± one standard error", columns, rows)


def _candidates_table(weighed: list[Json]) -> Table:
    columns = [Column("effect", numeric=False), Column("variant", numeric=False), Column("held-out gain")]
    columns += [Column("p-value"), Column("parameters", numeric=False), Column("decision", numeric=False)]
    columns.append(Column("because", numeric=False))
    rows = []
    for one in weighed:
        gain, accepted = one.get("held_out_gain"), one.get("decision") in ("accepted", "added", "chosen")
        rows.append(
            (
                text_cell(one["name"]),
                text_cell(one.get("variant") or ""),
                Cell(percent(gain, 3), gain),
                number_cell(one.get("p_value"), 2),
                text_cell(_values(one.get("parameters") or {})),
                text_cell(one.get("decision", ""), "good" if accepted else ""),
                text_cell(one.get("reason", "")),
            )
        )
    note = "Held-out gain: by how much the error on recordings that no fit has seen falls beyond re-tuned parameters."
    return Table("Effects that were weighed", columns, rows, note)


def _values(parameters: Json) -> str:
    """``gap = 2.5e-4 ± 1e-5 m``, for parameters with or without unit and error."""
    texts = []
    for name, value in parameters.items():
        if isinstance(value, dict):
            texts.append(
                f"{name} = {plus_minus(value['value'], value.get('stderr'))} {value.get('unit', '')}".strip()
            )
        else:
            texts.append(f"{name} = {plus_minus(value, None)}")
    return ", ".join(texts)


def _ratios_figure(part: Part, rows: list[tuple[str, str, Json, Json]]) -> Figure:
    drawn = Chart(f"{part.prefix}ratios", row_height=260)
    labels = [f"{channel}, {role_text(role)}" for role, channel, *_ in rows]
    for name, colour, k in (("before", BEFORE, 2), ("after", AFTER, 3)):
        heights = [noise_ratio(row[k]) if row[k] else None for row in rows]  # type: ignore[arg-type]
        drawn.bars(labels, heights, name, colour=colour)
    drawn.level(1.0)
    drawn.axes(y="rmse / noise [1]", x="signal and recordings [–]", y_options={"rangemode": "tozero"})
    return drawn.build(
        "Errors as multiples of the sensor's noise; dotted: the noise, which no model gets below."
    )


def _experiment(content: Json | str | None) -> list[tuple[str, str]]:
    """What to record next, as facts."""
    if not content:
        return []
    if isinstance(content, str):
        return [("experiment", content)]
    return [("experiment", f"{key.replace('_', ' ')}: {_plain(value)}") for key, value in content.items()]


def _plain(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{k} {_plain(v)}" for k, v in value.items())
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)
