"""The page's first section: what came out, the picture that shows it, what to do next; then how sure that is."""

from thsa_cosim.report.diagnose.evidence import evidence
from thsa_cosim.report.diagnose.verdict import held_out, recordings_table, verdict
from thsa_cosim.report.folder import Json, Part, Study
from thsa_cosim.report.identify.parameters import laws_figure
from thsa_cosim.report.page.steps import met, next_steps
from thsa_cosim.report.parts.comparison import MET, MISSED, all_errors, noise_ratio, ratio_mark, role_text
from thsa_cosim.report.parts.content import Block, Cell, Column, Facts, Figure, Section, Table, Text
from thsa_cosim.report.parts.failures import evaluations, failed
from thsa_cosim.report.parts.text import (
    DASH,
    bound_text,
    count,
    degrees,
    listing,
    number,
    number_cell,
    percent,
    plus_minus,
    quantity,
    search_label,
    significant_cell,
    text_cell,
)
from thsa_cosim.report.progress import duration
from thsa_cosim.report.tune.gains import term_label
from thsa_cosim.report.tune.responses import first_response

_STATUS = {
    "running": "The study is running. These are its results so far; the report command writes the page again,"
    " with --live until the study ends.",
    "stopped": "The study was stopped before its end. Its finished runs are kept.",
    "unfinished": "The study has not ended. Its folder does not show whether it is still running.",
    "interrupted": "The study was interrupted. These are the results of its finished part.",
}


def summary(study: Study, rate: float = 0.0) -> Section:
    """What came out, the picture that shows it, before and after, and what to do next; for any kind of study.

    ``rate``: evaluations a second of a study that runs; 0 where it is not known.
    """
    blocks: list[Block] = []
    status = study.status
    if status in _STATUS:
        command = study.whole.about.get("command")
        again = f" Continue with: {command}" if command and status != "running" else ""
        blocks.append(Text(_STATUS[status] + again, "bad" if status == "stopped" else ""))
    started = [part for part in study.parts if part.result is None and part.journal is not None]
    blocks += [Text(f"{part.title}: {_so_far(part, rate)}") for part in started]
    if study.whole.result is None:
        blocks.append(_question_facts(study))
    else:
        blocks += verdict_of(study)
    steps = next_steps(study)
    if steps:
        blocks.append(Facts([("next", text) for text in steps]))
    return Section("summary", "Summary", tuple(blocks))


def details(study: Study) -> Section | None:
    """What was asked, and how sure the answer is."""
    asked = () if study.whole.result is None else (_question_facts(study),)
    sure = Facts([("confidence", text) for text in _sure(study)])
    notes = [Text(f"Note: {note}") for note in _notes(study)]
    blocks = (*asked, *((sure,) if sure.items else ()), *notes)
    return Section("details", "Question and confidence", blocks) if blocks else None


def _question_facts(study: Study) -> Facts:
    return Facts([("question", text) for text in _asked(study)])


def verdict_of(study: Study) -> list[Block]:
    """The verdict in one sentence, the picture that shows it, and the tables that stand behind it."""
    result, kind = study.whole.result or {}, study.whole.kind
    blocks: list[Block] = []
    figure = telling(study)
    picture: list[Block] = [] if figure is None else [figure]
    if kind == "diagnose":
        sentence, *rest = verdict(result)
        blocks += [sentence, *picture, *recordings_table(result), *rest]
    elif kind == "tune":
        sentence, *rest = _tuned(result)
        blocks += [sentence, *picture, *rest]
    else:
        blocks += [met(study), *picture]
        if result.get("points"):
            blocks.append(_found_table(result))
    errors = _errors(study)
    return blocks if errors is None else [*blocks, errors]


def telling(study: Study) -> Figure | None:
    """The one picture that shows what came out; the sections below leave it out."""
    result = study.whole.result
    if result is None:
        return None
    if study.whole.kind == "diagnose":
        return evidence(study.whole)
    if study.whole.kind == "tune":
        return first_response(study.whole)
    return laws_figure(result)


def _asked(study: Study) -> list[str]:
    return [text for part in study.parts if (text := _question(part))]


def _question(part: Part) -> str:
    """One sentence on what a part was to find."""
    result, about = part.result or {}, part.about
    fmu = str(part.fmu.get("path") or "the FMU").replace("\\", "/").rsplit("/", 1)[-1]
    names = list(about.get("parameters", {}))
    search = f"differential evolution, {part.population} vectors, at most {part.generations} generations"
    if part.searches_locally:
        search = "local searches from several starts, differential evolution where they disagree"
    if part.kind == "identify":
        points = result.get("points", [])
        names = list(dict.fromkeys(n for p in points for n in p["parameters"])) or names
        at = [p["temperature_degC"] for p in points if p["temperature_degC"] is not None]
        where = (
            f" at {count(len(at), 'temperature')} ({degrees(min(at))} to {degrees(max(at))})" if at else ""
        )
        fitted = [r for r in result.get("recordings", []) if r["role"] == "fit"]
        held = len(result.get("recordings", [])) - len(fitted)
        data = (
            f" from {count(len(fitted), 'recording')}" + (f", {held} held out" if held else "")
            if fitted
            else ""
        )
        return f"Find {listing(names)} of {fmu}{where}{data}; {search}."
    if part.kind == "diagnose":
        data = " with held-out recordings" if result.get("before", {}).get("validate") else ""
        return f"Find the physical effect that {fmu} lacks to explain the recordings{data}."
    if part.kind == "simulate":
        recordings = result.get("recordings", [])
        return f"Simulate {fmu} with {count(len(recordings), 'recording')} and compare." if recordings else ""
    if part.kind == "tune":
        conditions = [
            f"{name} = {', '.join(number(v) for v in axis['values'])} {axis['unit']}"
            for name, axis in result.get("conditions", {}).items()
        ]
        names = list(result.get("units", {})) or names
        where = f" under {listing(conditions)}" if conditions else ""
        return f"Find {listing(names)} of {fmu}{where} by equation 7 with its requirements; {search}."
    return ""


def _so_far(part: Part, rate: float) -> str:
    done, broken = evaluations(part), sum(failed(part).values())
    stages = len({row.stage for row in part.journal.rows}) if part.journal else 0
    of = pace = ""
    if part.population and part.generations and stages:
        searches = len(part.about.get("samples", {})) or stages
        most = searches * part.population * (part.generations + 1)
        of = f" of at most {most}"
        if rate > 0.0 and most > done:
            pace = f" At most {duration((most - done) / rate)} left"
            pace += ", less where local searches agree." if part.searches_locally else "."
    if rate > 0.0:
        pace = f" {number(rate, 3)} evaluations a second.{pace}"
    searched = count(stages, "search", "searches")
    return f"{count(done, 'vector')} evaluated{of} in {searched}, {broken} failed so far.{pace}"


def _found_table(result: Json) -> Table:
    """Each parameter at its coldest and warmest point, with its law."""
    points: list[Json] = result["points"]
    laws: Json = result.get("laws", {})
    names = list(dict.fromkeys(n for p in points for n in p["parameters"]))
    own = {name: [p for p in points if name in p["parameters"]] for name in names}
    ends = {name: (found[0], found[-1])[: len(found)] for name, found in own.items()}
    # Where all parameters have the same coldest and warmest point, the headings say which.
    shared = {tuple(p["temperature_degC"] for p in found) for found in ends.values()}
    headings = [degrees(t) for t in next(iter(shared))] if len(shared) == 1 else ["coldest", "warmest"]
    columns = [Column("parameter", numeric=False), Column("unit", numeric=False), *map(Column, headings)]
    if laws:
        columns += [Column("law", numeric=False), Column("deviation from published")]
    rows = []
    for name in names:
        row = [text_cell(name), text_cell(own[name][0]["parameters"][name]["unit"])]
        row += [_estimate(p, name, with_place=len(shared) > 1) for p in ends[name]]
        row += [Cell(DASH)] * (len(headings) - len(ends[name]))
        if laws:
            law = laws.get(name, {})
            known = law.get("identifiable", True)
            away = (law.get("largest_deviation") or {}).get("points") if known else None
            row += [text_cell(law.get("form", DASH)), Cell(percent(away), away)]
        rows.append(row)
    note = (
        "Red: not determined by the data, or on a bound of the search."
        if any(c.mark == "bad" for r in rows for c in r)
        else ""
    )
    return Table("Result: values ± one standard error", columns, rows, note)


def _estimate(point: Json, name: str, with_place: bool) -> Cell:
    estimate = point["parameters"][name]
    place = f" at {degrees(point['temperature_degC'])}" if with_place else ""
    text = plus_minus(estimate["value"], estimate["stderr"]) + place
    text += f" ({bound_text(estimate)})" if bound_text(estimate) else ""
    return Cell(
        text, estimate["value"], "" if estimate["identifiable"] and not bound_text(estimate) else "bad"
    )


def _tuned(result: Json) -> list[Block]:
    after, before = result.get("after"), result.get("before")
    if not after:
        return [Text("No gains were found.", "lead bad")]
    units: Json = result.get("units", {})
    found = listing([f"{name} = {quantity(v, units.get(name, ''))}" for name, v in after["gains"].items()])
    requirements = result.get("requirements", [])
    met = [r for r in requirements if r.get("met")]
    feasible = bool(result.get("feasible"))
    kept = (
        f"{len(met)} of {count(len(requirements), 'requirement')} are met"
        if requirements
        else "none were required"
    )
    blocks: list[Block] = [Text(f"Found: {found}; {kept}.", "lead good" if feasible else "lead bad")]
    terms = [n for n in ("rise_time", "steady_state_error", "overshoot", "settling_time") if n in after]
    if before:
        term_units: Json = result.get("term_units", {})
        columns = (
            Column("quantity", numeric=False),
            Column("unit", numeric=False),
            Column("before"),
            Column("after"),
        )
        rows = [
            (
                text_cell(n),
                text_cell(u),
                number_cell(before["gains"].get(n)),
                number_cell(after["gains"].get(n)),
            )
            for n, u in units.items()
        ]
        rows.append(
            (
                text_cell("cost (equation 7)"),
                text_cell("1"),
                number_cell(before["cost"]),
                number_cell(after["cost"]),
            )
        )
        rows += [
            (
                text_cell(term_label(n)),
                text_cell(term_units.get(n, "")),
                number_cell(before.get(n)),
                number_cell(after[n]),
            )
            for n in terms
        ]
        blocks.append(Table("Result", columns, rows))
    return blocks


def _errors(study: Study) -> Table | None:
    """Rmse against noise per role and channel over the whole study."""
    rows = []
    for role, name, error in all_errors(study):
        ratio = noise_ratio(error)
        share = error.get("nrmse")
        cells = (significant_cell(error["rmse"]), significant_cell(error.get("noise")))
        rows.append(
            (
                text_cell(role_text(role)),
                text_cell(name),
                text_cell(error["unit"]),
                *cells,
                significant_cell(ratio, 3, ratio_mark(ratio)),
                Cell(percent(share), share),
            )
        )
    if not rows:
        return None
    columns = (
        Column("recordings", numeric=False),
        Column("signal", numeric=False),
        Column("unit", numeric=False),
        Column("rmse"),
        Column("noise (1 σ)"),
        Column("rmse / noise"),
        Column("rmse / range"),
    )
    return Table("Errors by signal", columns, rows)


def _sure(study: Study) -> list[str]:
    """Sentences on how far the numbers can be trusted."""
    result = study.whole.result
    if result is None:
        return []
    sentences = [sentence] if (sentence := held_out(result)) else []
    values = [(n, p, e) for p in result.get("points", []) for n, e in p["parameters"].items()]
    if values:
        sentences.append(_determined(values))
    ratios = [
        (f"{name} ({role_text(role)})", r)
        for role, name, e in all_errors(study)
        if (r := noise_ratio(e)) is not None
    ]
    if ratios:
        name, worst = max(ratios, key=lambda item: item[1])
        what = f"The largest error is {number(worst, 3)} × the sensor's noise, in {name}"
        if worst <= MET:
            sentences.append(f"{what}: the model explains these recordings down to the noise.")
        elif worst <= MISSED:
            sentences.append(f"{what}: the model leaves a small residual unexplained.")
        else:
            sentences.append(
                f"{what}: the model does not explain the recordings, and the standard errors are too small."
            )
    sentences += _agreement(result.get("points", []))
    groups = result.get("groups", [])
    if groups:
        open_ended = [g for g in groups if not str(g["stopped"]).startswith("converged")]
        ended = f"{len(groups) - len(open_ended)} of {count(len(groups), 'search', 'searches')} converged"
        sentences.append(f"{ended}{'; more generations may find better gains' if open_ended else ''}.")
    done = sum(evaluations(part) for part in study.parts)
    broken = sum(sum(failed(part).values()) for part in study.parts)
    if done:
        sentences.append(f"{count(done, 'evaluation')}, {broken or 'none'} failed.")
    return sentences


def _agreement(points: list[Json]) -> list[str]:
    """How many local searches ended in the same minimum: together where all did, else by point."""
    local = [p for p in points if p.get("local")]
    if not local:
        return []
    if all(p["agreed"] == len(p["local"]) for p in local):
        fewest = min(len(p["local"]) for p in local)
        at = "" if len(local) == 1 else f" at each of {len(local)} points"
        return [f"{fewest} of {fewest} local searches from different starts agree{at}."]
    return [f"{search_label(p['label'])}: {p['stopped']}." for p in local if p["agreed"] < len(p["local"])]


def _determined(values: list[tuple[str, Json, Json]]) -> str:
    unsure = [f"{n} at {degrees(p['temperature_degC'])}" for n, p, e in values if not e["identifiable"]]
    shares = [
        (e["stderr"] / abs(e["value"]), f"{n} at {degrees(p['temperature_degC'])}")
        for n, p, e in values
        if e["identifiable"] and e["stderr"] and e["value"]
    ]
    widest = (
        f"; the least certain of the others is {max(shares)[1]}, ± {percent(max(shares)[0])}"
        if shares
        else ""
    )
    if unsure:
        share = f"{len(unsure)} of {count(len(values), 'value')}"
        return f"{share} are not determined by the data: {listing(unsure)}{widest}."
    widest = f"; the least certain is {max(shares)[1]}, ± {percent(max(shares)[0])}" if shares else ""
    return (
        f"The data determine {'the one value' if len(values) == 1 else f'all {len(values)} values'}{widest}."
    )


def _notes(study: Study) -> list[str]:
    notes = [str(note) for note in (study.whole.result or {}).get("notes", [])]
    if study.in_stages:
        notes += [f"{p.name}: {note}" for p in study.parts for note in (p.result or {}).get("notes", [])]
    return list(dict.fromkeys(notes))
