"""What a page says of a model in one sentence, and what its reader should do next."""

from thsa_cosim.report.folder import Json, Study
from thsa_cosim.report.parts.comparison import MET, MISSED, all_errors, noise_ratio
from thsa_cosim.report.parts.content import Text
from thsa_cosim.report.parts.text import bound_text, count, listing, number


def met(study: Study) -> Text:
    """How well an identified or simulated model meets the recordings, in one sentence."""
    result = study.whole.result or {}
    points = result.get("points", [])
    names = list(dict.fromkeys(n for p in points for n in p["parameters"]))
    unsure = sum(not e["identifiable"] for p in points for e in p["parameters"].values())
    trust = (result.get("trust") or {}).get("verdict")
    ratios = [r for _, _, e in all_errors(study) if (r := noise_ratio(e)) is not None]
    worst = max(ratios, default=None)
    found = f"Found {listing(names)}" if names else "Simulated"
    if unsure:
        found += f", {count(unsure, 'value')} of them not determined by the data"
    if worst is None or trust == "explained" or (trust is None and worst <= MET):
        met = (
            "the model explains the recordings down to the noise"
            if worst is not None
            else "no signal was compared"
        )
        return Text(f"{found}: {met}.", "lead" + (" bad" if unsure else " good"))
    lacks = "does not explain the recordings" if worst > MISSED else "leaves a small residual unexplained"
    text = f"{found}, but the model {lacks}: the largest error is {number(worst, 3)} × the sensor's noise."
    return Text(text, "lead bad" if worst > MISSED else "lead")


def next_steps(study: Study) -> list[str]:
    """What a reader should do with this, most urgent first."""
    result, kind, folder = study.whole.result or {}, study.whole.kind, study.whole.folder
    data = result.get("data") or {}
    steps = []
    if data.get("verdict") == "bad":
        steps.append("Repair the recordings first. The section on the data lists their defects.")
    if study.status != "complete":
        return steps
    if kind == "diagnose":
        steps += _after_diagnosis(result)
    elif kind == "tune":
        steps.append(
            "Use the gains in the controller, and check them on the bench at the worst condition listed below."
            if result.get("feasible")
            else "Relax a requirement or widen the bounds of the gains: no set of gains meets all requirements."
        )
    else:
        unsure = {
            n for p in result.get("points", []) for n, e in p["parameters"].items() if not e["identifiable"]
        }
        at_bound = {n for p in result.get("points", []) for n, e in p["parameters"].items() if bound_text(e)}
        worst = max((r for _, _, e in all_errors(study) if (r := noise_ratio(e)) is not None), default=0.0)
        if at_bound:
            steps.append(f"Widen the bounds of {listing(sorted(at_bound))}: a value lies on a bound.")
        if unsure:
            steps.append(
                f"Record an experiment that excites {listing(sorted(unsure))}, or fix it at a known value."
            )
        if worst > MISSED:
            steps.append(
                "Run thsa-cosim diagnose with this model and these recordings to find the missing effect."
            )
    if not steps and kind == "identify":
        steps.append(f"Use the values: {folder / 'identified.ssv'} holds them for any FMI tool.")
    return steps


def _after_diagnosis(result: Json) -> list[str]:
    steps = []
    word = result.get("verdict")
    best = result.get("experiment") or {}
    if best.get("separates", bool(best)) and any(e.get("equivalent") for e in result.get("effects", [])):
        steps.append(
            f"Record {best['name']} ({best.get('file', 'experiment.csv')}): it separates the equivalent effects."
        )
    if word == "missing-effect" and result.get("fmu"):
        steps.append(
            f"Use the extended model {result['model']}, or its FMU {result['fmu']}, in place of the declared one."
        )
    if word == "no-missing-effect":
        steps.append("Keep the model, with the parameters that were identified here.")
    if word == "unexplained-structure":
        steps.append(
            "See below what the residual depends on, then add an effect of your own (docs/howto/own-effect.md)."
        )
    if word == "not-tested":
        steps.append("Record an experiment that excites the effects, or add effect slots to the model.")
    return steps
