"""A diagnosis: the verdict with the effects it names, and whether they help on recordings that no fit has seen."""

from collections.abc import Sequence

from thsa_cosim.report.folder import Json, Part
from thsa_cosim.report.parts.chart import AFTER, BEFORE, Chart
from thsa_cosim.report.parts.comparison import noise_ratio, ratio_mark, recording_folds, role_text
from thsa_cosim.report.parts.content import Block, Cell, Column, Facts, Figure, Fold, Section, Table, Text
from thsa_cosim.report.parts.text import (
    DASH,
    count,
    listing,
    number,
    number_cell,
    percent,
    plus_minus,
    significant_cell,
    text_cell,
)
from thsa_cosim.report.signal_files import read_signals, signal_paths, signal_units

_VERDICTS = {
    "missing-effect": "The model lacks {effects}. Adding it lowers the error on held-out recordings.",
    "no-missing-effect": "The model lacks nothing that these recordings show. What is left is noise, or is explained by"
    " re-fitted declared parameters.",
    "unexplained-structure": "A repeatable residual is left that no effect of the catalogue explains; the section on"
    " structure shows what it depends on.",
    "not-tested": "No effect could be tried on this model and these recordings.",
}
_DOUBT = "A residual is left: standard errors are those of a model that lacks nothing, and values may be off by more."


def verdict(result: Json) -> tuple[Block, ...]:
    """What the summary says first: the verdict, each effect with its parameters, and what would tell rivals apart."""
    word = str(result["verdict"])
    effects: list[Json] = result.get("effects", [])
    names = listing([_name(e) for e in effects])
    sentence = _VERDICTS.get(word, word).format(effects=names)
    if word == "unexplained-structure" and effects:
        sentence = f"The model lacks {names}. In addition, a" + sentence[1:]
    blocks: list[Block] = [Text(sentence, "lead good" if word == "no-missing-effect" else "lead bad")]
    if effects:
        blocks.append(_effects_table(effects, _doubt(result)))
    facts = []
    if result.get("unexplained") is not None:
        facts.append(
            (
                "left",
                f"{percent(result['unexplained'])} of the repeatable residual is left in the worst signal.",
            )
        )
    alike = [f"{e['name']} from {listing(e['equivalent'])}" for e in effects if e.get("equivalent")]
    if alike:
        facts.append(("not distinguished", f"These recordings cannot distinguish {listing(alike)}."))
    facts += _experiment(result.get("experiment"))
    files = [str(result[key]) for key in ("model", "fmu") if result.get(key)]
    if files:
        facts.append(("extended model", ", ".join(files)))
    return (*blocks, Facts(facts)) if facts else tuple(blocks)


def recordings_table(result: Json) -> list[Block]:
    """Errors before and after as multiples of the noise: pooled by role, then for each recording."""
    rows: list[tuple[str, _Ratios]] = []
    for role in ("fit", "validate"):
        rows += _ratio_rows(result, (role,), role_text(role))
    names = dict.fromkeys((result.get("before") or {}).get("recordings", {}))
    for name in names:
        rows += _ratio_rows(result, ("recordings", name), name)
    if not rows:
        return []
    channels = list(dict.fromkeys(channel for _, own in rows for channel in own))
    columns = [Column("recordings", numeric=False)]
    columns += [Column(channel) for channel in channels]
    cells = []
    for label, own in rows:
        line = [text_cell(label)]
        for channel in channels:
            before, after = own.get(channel, (None, None))
            text = significant_cell(before).text + (
                "" if after is None else f" → {significant_cell(after).text}"
            )
            line.append(Cell(text, before if after is None else after, ratio_mark(after)))
        cells.append(line)
    note = "rmse / noise, before → after. 1 is the best that a model can reach. Green: the error equals the noise."
    return [Table("Errors before → after, as multiples of the noise", columns, cells, note)]


_Ratios = dict[str, tuple[float | None, float | None]]


def _ratio_rows(result: Json, place: Sequence[str], label: str) -> list[tuple[str, _Ratios]]:
    """The errors at a place of ``before`` and ``after``, by channel; no row where there are none."""
    before, after = result.get("before") or {}, result.get("after") or {}
    for key in place:
        before, after = before.get(key) or {}, after.get(key) or {}
    own = {
        channel: (noise_ratio(error), noise_ratio(after[channel]) if channel in after else None)
        for channel, error in before.items()
    }
    return [(label, own)] if own else []


def held_out(result: Json) -> str:
    """One sentence on how far the error on held-out recordings fell; empty without such recordings."""
    ratios = [
        [
            r
            for e in (result.get(when) or {}).get("validate", {}).values()
            if (r := noise_ratio(e)) is not None
        ]
        for when in ("before", "after")
    ]
    if not ratios[0]:
        return ""
    now = number(max(ratios[0]), 3)
    if not ratios[1]:
        return f"On held-out recordings the largest error is {now} × the sensor's noise."
    return (
        f"On held-out recordings the largest error falls from {now} × the sensor's noise to"
        f" {number(max(ratios[1]), 3)} × noise."
    )


def before_after(part: Part) -> Section | None:
    """Errors of the declared and the extended model, as multiples of the noise; None before the end."""
    result = part.result or {}
    rows: list[_Pair] = []
    for role in ("fit", "validate"):
        before, after = result.get("before", {}).get(role, {}), result.get("after", {}).get(role, {})
        rows += [(role, channel, error, after.get(channel, {})) for channel, error in before.items()]
    if not rows:
        return None
    blocks: list[Block] = [_ratios_figure(part, rows), _errors_table(rows, signal_units(part.folder))]
    declared: Json = result.get("parameters") or {}
    if declared.get("before"):
        blocks.append(_declared_table(declared["before"], declared.get("after") or {}, _doubt(result)))
    return Section(f"{part.prefix}before-after", "Before and after", tuple(blocks))


_Pair = tuple[str, str, Json, Json]
"""Role, channel, and its error before and after; empty where there is no after."""


def _errors_table(rows: list[_Pair], units: Json) -> Table:
    columns = [Column(text, numeric=False) for text in ("recordings", "signal", "unit")]
    columns += [
        Column(text) for text in ("rmse before", "after", "noise (1 σ)", "before / noise", "after / noise")
    ]
    columns += [Column(text) for text in ("structure before", "after")]
    table = []
    for role, channel, before, after in rows:
        ratios = [noise_ratio(error) if error else None for error in (before, after)]
        errors = (before.get("rmse"), after.get("rmse"), before.get("noise"))
        table.append(
            (
                text_cell(role_text(role)),
                text_cell(channel),
                text_cell(before.get("unit") or units.get(channel, "")),
                *(significant_cell(v) for v in errors),
                significant_cell(ratios[0]),
                significant_cell(ratios[1], 3, ratio_mark(ratios[1])),
                *(significant_cell(error.get("structure"), 2) for error in (before, after)),
            )
        )
    note = (
        "Before: the declared model, its parameters identified again. After: the extended model likewise. Structure:"
        " the part of the residual that is not noise."
    )
    return Table("Errors before and after", columns, table, note)


def _declared_table(before: Json, after: Json, doubt: str) -> Table:
    columns = [Column("declared parameter", numeric=False), Column("unit", numeric=False)]
    columns += [Column("before"), Column("after")]
    rows = []
    for name, value in before.items():
        own = [value, after.get(name) or {}]
        cells = [Cell(plus_minus(v.get("value"), v.get("stderr")), v.get("value")) for v in own]
        rows.append((text_cell(name), text_cell(value.get("unit", "")), *cells))
    return Table(
        "Declared parameters of each model, re-identified, ± one standard error", columns, rows, doubt
    )


def _doubt(result: Json) -> str:
    """What standard errors do not hold, where the last model leaves something; else empty."""
    law: Json = result.get("empirical") or {}
    return _DOUBT if result.get("verdict") == "unexplained-structure" and not law.get("added") else ""


def recordings(part: Part) -> Section | None:
    """Measured, before and after, for every recording and channel."""
    found = [read_signals(path) for path in signal_paths(part.folder)]
    if not found:
        return None
    return Section(f"{part.prefix}signals", "Measured against simulated", tuple(recording_folds(part, found)))


def candidates(part: Part) -> Section | None:
    """Every effect that was weighed, and those that these recordings cannot test."""
    result = part.result or {}
    weighed: list[Json] = [c for c in result.get("candidates", []) if c.get("decision") != "not testable"]
    refined = [c for c in weighed if c.get("held_out_gain") is not None]
    others = [c for c in weighed if c.get("held_out_gain") is None]
    skipped: list[Json] = result.get("not_testable", [])
    blocks: list[Block] = []
    if refined:
        blocks.append(
            _candidates_table("Effects that were fitted and scored on held-out recordings", refined)
        )
    if others:
        table = _candidates_table("Effects whose predicted gain was too small to fit them", others)
        blocks.append(
            Fold(f"{count(len(others), 'effect')} with a predicted gain that was too small", (table,))
        )
    if skipped:
        rows = [(text_cell(s["name"]), text_cell(s.get("reason", ""))) for s in skipped]
        columns = (Column("effect", numeric=False), Column("why not", numeric=False))
        blocks.append(Table("Effects that these recordings cannot test", columns, rows))
    alike: list[Json] = result.get("equivalence", [])
    if alike:
        rows = [(text_cell(listing(c["names"])), number_cell(c["angle_deg"], 2)) for c in alike]
        columns = (Column("effects", numeric=False), Column("principal angle [deg]"))
        note = "For effects of a typical size, in the first round. The angle is between their responses in the signals."
        blocks.append(Table("Effects that would look alike in these recordings", columns, rows, note))
    return Section(f"{part.prefix}candidates", "Effects that were weighed", tuple(blocks)) if blocks else None


def _effects_table(effects: list[Json], doubt: str) -> Table:
    columns = [Column("effect", numeric=False), Column("probability"), Column("parameter", numeric=False)]
    columns += [
        Column("value"),
        Column("unit", numeric=False),
        Column("not distinguished from", numeric=False),
    ]
    rows, reasons = [], []
    for effect in effects:
        likely, alike = effect.get("probability"), listing(effect.get("equivalent") or [])
        named = [text_cell(_name(effect)), Cell(_probability(likely), likely)]
        if not effect.get("parameters"):
            rows.append((*named, text_cell(DASH), Cell(DASH), text_cell(""), text_cell(alike)))
        for name, value in effect.get("parameters", {}).items():
            text, mark = plus_minus(value["value"], value.get("stderr")), ""
            if value.get("identifiable") is False:
                text, mark = f"({text})", "bad"
                reasons.append(f"{name}, {value['reason']}" if value.get("reason") else name)
            own = (text_cell(name), Cell(text, value["value"], mark), text_cell(value.get("unit", "")))
            rows.append((*named, *own, text_cell(alike)))
    brackets = f"In brackets: not determined by these data: {'; '.join(reasons)}." if reasons else ""
    note = " ".join(filter(None, (brackets, doubt)))
    return Table("Result: effects with their parameters ± one standard error", columns, rows, note)


def _probability(share: float | None) -> str:
    """``99 %``; never 100 %, because no recording can prove it."""
    return "> 99.9 %" if share is not None and share > 0.999 else percent(share, 3)


def _name(effect: Json) -> str:
    """``backlash (Backlash of the screw)``."""
    return f"{effect['name']} ({effect['title']})" if effect.get("title") else str(effect["name"])


def _candidates_table(title: str, weighed: list[Json]) -> Table:
    columns = [Column("round"), Column("effect", numeric=False)]
    columns += [Column("gain of the fit"), Column("held-out gain"), Column("p-value")]
    columns += [Column(text, numeric=False) for text in ("parameters", "decision", "because")]
    marks = {"accepted": "good", "rival": "good"}
    rows = [
        (
            number_cell(one.get("round")),
            text_cell(one.get("variant") or one["name"]),
            number_cell(one.get("fit_gain"), 3),
            number_cell(one.get("held_out_gain"), 3),
            number_cell(one.get("p_value"), 2),
            text_cell(_values(one.get("parameters") or {})),
            text_cell(one.get("decision", ""), marks.get(one.get("decision", ""), "")),
            text_cell(one.get("reason", "")),
        )
        for one in weighed
    ]
    note = (
        "Gain: decrease of the sum of squared residuals (in units of the noise variance) beyond what the declared"
        " parameters explain. Held-out gain: the same on recordings that no fit has used."
    )
    return Table(title, columns, rows, note)


def _values(parameters: Json) -> str:
    """``gap = (2.50 ± 0.10)e-4 m, …``."""
    texts = []
    for name, value in parameters.items():
        unit = "" if value.get("unit") in (None, "1") else f" {value['unit']}"
        texts.append(f"{name} = {plus_minus(value['value'], value.get('stderr'))}{unit}")
    return ", ".join(texts)


def _ratios_figure(part: Part, rows: list[_Pair]) -> Figure:
    drawn = Chart(f"{part.prefix}ratios", row_height=260)
    labels = [f"{channel}, {role_text(role)}" for role, channel, *_ in rows]
    before = [noise_ratio(error) for *_, error, _ in rows]
    after = [noise_ratio(error) if error else None for *_, error in rows]
    for name, colour, heights in (("before", BEFORE, before), ("after", AFTER, after)):
        if any(height is not None for height in heights):
            drawn.bars(labels, heights, name, colour=colour)
    drawn.level(1.0)
    drawn.axes(y="rmse / noise [1]", x="signal and recordings [–]", y_options={"rangemode": "tozero"})
    return drawn.build(
        "Errors as multiples of the sensor's noise. Dotted: the noise, which no model can go below."
    )


def _experiment(content: Json | None) -> list[tuple[str, str]]:
    """What to record next, as a fact."""
    if not content:
        return []
    if one := content.get("sharpens"):
        falls = f"{one['variable']} from {number(one['before'], 2)} to {number(one['after'], 2)}"
        text = f"Record {content['name']} ({content['file']}): the standard error of {falls}"
        return [("next experiment", f"{text}, as far as the fitted model can tell.")]
    if not content.get("separates", True):
        text = f"No profile within the limits is expected to distinguish {listing(content['rivals'])}"
        return [("next experiment", f"{text}: in these signals they may be one law.")]
    distance, present = content.get("distance"), content.get("present")
    file, rivals = content.get("file", "experiment.csv"), listing(content["rivals"])
    text = f"Record {content['name']} ({file}). It separates {rivals}"
    if distance and present:
        ratio = f"{distance / present:.2g}" if distance < 10.0 * present else f"{distance / present:.0f}"
        text += f": the squared difference of the two fitted models is {ratio} times that in these recordings"
    return [("next experiment", f"{text}.")]
