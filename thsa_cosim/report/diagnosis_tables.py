"""What the command line prints at the end of a diagnosis (rich)."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from thsa_cosim.diagnosis.results import DiagnosisResult
from thsa_cosim.report.tables import force_sentence, number


def sentence(result: DiagnosisResult) -> str:
    """The verdict as a test engineer would say it."""
    if result.verdict == "no-missing-effect":
        return "No missing effect: what is left is noise, or declared parameters that were tuned again."
    found = " and ".join(f"{e.title[0].lower()}{e.title[1:]} ({e.name})" for e in result.effects)
    if result.verdict == "missing-effect":
        text = f"The model lacks {found}."
        rivals = [name for e in result.effects for name in e.equivalent]
        if rivals:
            text += f" These recordings cannot tell it from {', '.join(rivals)}."
        return text
    text = "Structure is left that no effect of the catalogue explains"
    share = f" ({100 * result.unexplained:.0f} % of the repeatable residual)"
    return text + share + (f"; added all the same: {found}." if found else ".")


def print_diagnosis(console: Console, result: DiagnosisResult) -> None:
    """Print the verdict, the effects, the errors before and after, and the best candidates."""
    console.print(Text(sentence(result), style="bold"), highlight=False)
    if result.effects:
        console.print(_effects(result))
    console.print(_errors(result))
    for model, force in (("Declared model", result.force_before), ("Extended model", result.force_after)):
        if force is not None:
            console.print(Text(f"{model}: {force_sentence(force)}"), highlight=False)
    console.print(_candidates(result))
    for balance in result.balances:
        if balance.at_fault:
            console.print(
                Text(
                    f"The {balance.equation} balance does not close: {balance.rmse:.3g} {balance.unit}, the sensors'"
                    f" noise makes {balance.noise:.3g}."
                )
            )
    if result.experiment is not None:
        best = result.experiment
        console.print(
            Text(
                f"To tell {best.rivals[0]} from {best.rivals[1]}, run {best.name} (experiment.csv): {best.distance:.3g}"
            )
        )
    for note in result.notes:
        console.print(Text(f"note: {note}"), highlight=False)


def _effects(result: DiagnosisResult) -> Table:
    table = Table(title="Effects added to the model", title_justify="left")
    for heading in ("effect", "parameter", "value", "standard error", "unit"):
        table.add_column(heading, justify="right" if heading in ("value", "standard error") else "left")
    for effect in result.effects:
        for name, value in effect.parameters.items():
            table.add_row(Text(effect.name), name, number(value.value), number(value.stderr, 2), value.unit)
    return table


def _errors(result: DiagnosisResult) -> Table:
    table = Table(title="Error on held-out recordings, as multiples of the noise", title_justify="left")
    table.add_column("signal")
    for heading in ("declared model", "extended model", "noise"):
        table.add_column(heading, justify="right")
    for channel, error in result.before.get("validate", {}).items():
        after = result.after.get("validate", {}).get(channel)
        table.add_row(
            Text(channel),
            number(error.rmse / error.noise, 3),
            number(None if after is None else after.rmse / after.noise, 3),
            number(error.noise, 3),
        )
    return table


def _candidates(result: DiagnosisResult) -> Table:
    table = Table(title="Candidates, the most telling first", title_justify="left")
    for heading in ("candidate", "gain", "held-out gain", "decision", "reason"):
        table.add_column(heading, justify="right" if "gain" in heading else "left", overflow="fold")
    for one in [j for j in result.judged if j.round == 1][:8]:
        table.add_row(
            Text(one.variant),
            number(one.fit_gain, 3),
            number(one.held_out_gain, 3),
            one.decision,
            Text(one.reason),
        )
    return table
