"""What the command line prints at the end of a diagnosis (rich), from what result.json holds."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from thsa_cosim.report.parts.text import number

Content = Mapping[str, Any]


def sentence(content: Content) -> str:
    """The verdict as a test engineer would say it."""
    if content["verdict"] == "no-missing-effect":
        return "No missing effect: what is left is noise, or is explained by re-fitted declared parameters."
    effects = content["effects"]
    found = " and ".join(f"{e['title'][0].lower()}{e['title'][1:]} ({_place(e)})" for e in effects)
    if content["verdict"] == "missing-effect":
        text = f"The model lacks {found}."
        ties = [f"{e['name']} from {', '.join(e['equivalent'])}" for e in effects if e["equivalent"]]
        if ties:
            text += f" These recordings cannot distinguish {' and '.join(ties)}."
        return text
    if content["verdict"] == "not-tested":
        return "No effect could be tried on this model and these recordings: see the notes."
    share = f"{100 * content['unexplained']:.0f} % of the repeatable residual in the worst signal"
    if found:
        text = (
            f"The model lacks {found}; a repeatable residual is left that no effect of the catalogue explains"
        )
        return f"{text} ({share})."
    return f"A repeatable residual is left that no effect of the catalogue explains ({share})."


def _place(effect: Mapping[str, Any]) -> str:
    order = effect.get("order")
    return f"{effect['name']}, {order}" if order else str(effect["name"])


def print_diagnosis(console: Console, content: Content) -> None:
    """Print the verdict, the effects, the errors before and after, and the best candidates."""
    console.print(Text(sentence(content), style="bold"), highlight=False)
    if content["effects"]:
        console.print(_effects(content))
    console.print(_errors(content))
    for text in (
        *_known(content),
        *_forces(content),
        *_faults(content),
        *empirical_law(content),
        *rival_laws(content),
        *_undetermined(content),
        *_alike(content),
        *_advice(content),
    ):
        console.print(Text(text), highlight=False)
    console.print(_candidates(content))
    for note in content["notes"]:
        console.print(Text(f"note: {note}"), highlight=False)


def _effects(content: Content) -> Table:
    table = Table(title="Effects added to the model", title_justify="left")
    for heading in ("effect", "parameter", "value", "standard error", "unit"):
        table.add_column(heading, justify="right" if heading in ("value", "standard error") else "left")
    for effect in content["effects"]:
        for name, value in effect["parameters"].items():
            error = number(value["stderr"], 2) + (
                "" if value.get("identifiable", True) else " (not determined)"
            )
            table.add_row(Text(effect["name"]), name, number(value["value"]), error, value["unit"])
    return table


def _known(content: Content) -> list[str]:
    """The effects that the scenario declares, with the last model's values."""
    return [
        f"Known effect {e['name']}: "
        + ", ".join(
            f"{name} = {number(p['value'])} ± {number(p['stderr'], 2)} {p['unit']}"
            for name, p in e["parameters"].items()
        )
        + "."
        for e in content.get("known", [])
    ]


def _errors(content: Content) -> Table:
    table = Table(title="Error on held-out recordings, as multiples of the noise", title_justify="left")
    table.add_column("signal")
    for heading in ("declared model", "extended model", "noise"):
        table.add_column(heading, justify="right")
    for channel, error in content["before"].get("validate", {}).items():
        after = content["after"].get("validate", {}).get(channel)
        table.add_row(
            Text(channel),
            number(error["rmse"] / error["noise"], 3),
            number(None if after is None else after["rmse"] / after["noise"], 3),
            number(error["noise"], 3),
        )
    return table


def _forces(content: Content) -> list[str]:
    """The force residual of both models, if the scenario asks for it."""
    force = content.get("force_residual")
    if not force:
        return []
    unit, laps = force["unit"], force["repeatability"]
    found = []
    for model in ("before", "after"):
        parts = ", ".join(f"{number(rms, 3)} {unit} ({part})" for part, rms in force[model].items())
        if parts:
            name = "declared" if model == "before" else "extended"
            found.append(f"Force residual below {force['band_Hz']:g} Hz, {name} model: {parts}.")
    return found + ([] if laps is None else [f"Laps differ by {number(laps, 2)} {unit}."])


def _faults(content: Content) -> list[str]:
    """The balance equations that do not close."""
    return [
        f"The balance {b['equation']} does not close: {b['rmse']:.3g} {b['unit']}, where the sensors' noise explains"
        f" {b['noise']:.3g}."
        for b in content["balance"]
        if b["at_fault"]
    ]


def empirical_law(content: Content) -> list[str]:
    """What describes the structure that no effect explains, as an equation in the slot's variables."""
    law = content["empirical"]
    if law is None:
        return []
    terms = _sum(law["terms"])
    fate = (
        "It was added to the model."
        if law["added"]
        else "empirical = true in [diagnose] adds it to the model."
    )
    return [
        f"Empirical law (descriptive, not physical): {terms}; held-out gain"
        f" {number(law['held_out_gain'], 3)} noise variances. {fate}"
    ]


def rival_laws(content: Content) -> list[str]:
    """The laws that explain the held-out recordings as well as the effects, or the law that was found."""
    effects = "the effects from an empirical law in place of them"
    named = effects if content["effects"] else "this law from another"
    return [
        f"These recordings could not distinguish {named}: {_sum(law['terms'])}."
        for law in content.get("instead", [])
    ]


def _sum(terms: Sequence[Mapping[str, Any]]) -> str:
    return " + ".join(
        f"({number(t['coefficient'], 3)} +- {number(t['stderr'], 1)}{_unit(t['unit'])}) {t['term']} at {t['slot']}"
        for t in terms
    )


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def _alike(content: Content) -> list[str]:
    """What these recordings cannot distinguish from a named effect of a typical size; the page has all classes."""
    named = {e["name"] for e in content["effects"]}
    return [
        f"These recordings could not distinguish effects of a typical size: {', '.join(c['names'])} (principal angle"
        f" {number(c['angle_deg'], 2)} deg)."
        for c in content["equivalence"]
        if named & set(c["names"])
    ]


def _advice(content: Content) -> list[str]:
    """The experiment that would tell rivals apart, where there are any."""
    rivals = [name for e in content["effects"] for name in e["equivalent"]]
    return next_experiment(content) if rivals and content["experiment"] is not None else []


def next_experiment(content: Content) -> list[str]:
    """What to record next, and what is expected of it; the sentence that says why not, where there is nothing."""
    best = content["experiment"]
    if best is None:
        return [
            "No next experiment: it needs an accepted effect, diagnose.command, and a profile within the limits."
        ]
    if best.get("sharpens"):
        one = best["sharpens"]
        return [
            f"Next experiment: {best['name']} ({best['file']}). Expected: the standard error of {one['variable']} falls"
            f" from {number(one['before'], 2)} to {number(one['after'], 2)}{_unit(_unit_of(content, one['variable']))}."
            " Then diagnose again with --with RECORDING."
        ]
    names = " from ".join([best["rivals"][0], ", ".join(best["rivals"][1:])])
    expected = best.get("expected", best["distance"])
    if not best.get("separates", True):
        return [
            f"No profile within the limits is expected to distinguish {names} (best: {best['name']}, a gap of"
            f" {number(expected**0.5, 2)} standard deviations). In these signals they may be one law."
        ]
    return [
        f"To distinguish {names}, run {best['name']} ({best['file']}). Expected: a gap of {number(expected**0.5, 2)}"
        " standard deviations once the rival is fitted to it. Then diagnose again with --with RECORDING."
    ]


def _unit_of(content: Content, variable: str) -> str:
    """Unit of an effect's parameter by its variable; "1" for one that is not listed."""
    name = variable.rpartition(".")[2]
    listed = {n: p["unit"] for e in content["effects"] for n, p in e["parameters"].items()}
    return str(listed.get(variable, listed.get(name, "1")))


def _undetermined(content: Content) -> list[str]:
    """Values of the model as it ends that the recordings do not determine, with why."""
    declared = content["parameters"]["after" if content["effects"] else "before"]
    values = [
        (name, value) for name, value in declared.items() if value.get("reason", "").startswith("it ended")
    ]
    for effect in content["effects"]:
        values += [(f"{effect['name']}: {n}", v) for n, v in effect["parameters"].items() if v.get("reason")]
    return [f"Not determined: {name}, {value['reason']}." for name, value in values]


def _candidates(content: Content) -> Table:
    """What was refined in each round, and the most promising of the first."""
    table = Table(title="Candidates, the most telling first", title_justify="left")
    for heading in ("round", "candidate", "gain", "held-out gain", "decision", "reason"):
        right = "gain" in heading or heading == "round"
        table.add_column(heading, justify="right" if right else "left", overflow="fold")
    rounds: dict[int, list[Mapping[str, Any]]] = {}
    for one in content["candidates"]:
        rounds.setdefault(one["round"], []).append(one)
    for number_, own in rounds.items():
        for one in own[:8] if number_ == 1 else [c for c in own if c["held_out_gain"] is not None][:4]:
            gains = number(one["fit_gain"], 3), number(one["held_out_gain"], 3)
            table.add_row(str(number_), Text(one["variant"]), *gains, one["decision"], Text(one["reason"]))
    return table
