"""A diagnosis as result.json (the contract of the command line) and the files next to it."""

import json
import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from thsa_cosim.diagnosis.results import (
    Balance,
    DiagnosisResult,
    EmpiricalLaw,
    EmpiricalTerm,
    Errors,
    Evidence,
    FoundEffect,
    Judged,
    RivalLaw,
    SeparatingExperiment,
    StructuredError,
    Value,
)
from thsa_cosim.identify import ForceBalance
from thsa_cosim.inspection import Trust, judge_ratios
from thsa_cosim.report.diagnose.extended import write_extended_scenario
from thsa_cosim.report.files import RESULT, write_csv, write_json
from thsa_cosim.report.page.pictures import write_pictures
from thsa_cosim.report.signal_files import write_signals


def diagnosis_json(result: DiagnosisResult, folder: Path) -> dict[str, Any]:
    """What result.json holds; paths of what the study wrote are relative to ``folder``."""
    return {
        "kind": "diagnose",
        "title": result.title,
        "status": result.status,
        "verdict": result.verdict,
        "effects": [_effect(e) for e in result.effects],
        "known": [{"name": e.name, "parameters": _values(e.parameters)} for e in result.known],
        "before": {**_errors(result.before), "recordings": _errors(result.recordings_before)},
        "after": {**_errors(result.after), "recordings": _errors(result.recordings_after)},
        "unexplained": result.unexplained,
        "model": None if result.model is None else result.model.name,
        "fmu": None if result.extended_fmu is None else result.extended_fmu.name,
        "wrapper": None if result.wrapper is None else result.wrapper.name,
        "parameters": {
            "before": _values(result.declared_before),
            "after": _values(result.declared_after),
        },
        "force_residual": None
        if result.force_before is None
        else _force(result.force_before, result.force_after),
        "threshold": result.threshold,
        "candidates": [_candidate(j) for j in result.judged],
        "not_testable": [
            {"name": j.variant, "reason": j.reason} for j in result.judged if j.decision == "not testable"
        ],
        "balance": [_balance(b) for b in result.balances],
        "evidence": None if result.evidence is None else _evidence(result.evidence),
        "empirical": None if result.empirical is None else _law(result.empirical),
        **({"instead": [_rival(law) for law in result.instead]} if result.instead else {}),
        "equivalence": [{"names": list(c.names), "angle_deg": c.angle_deg} for c in result.equivalence],
        "experiment": None if result.experiment is None else _experiment(result.experiment),
        "data": result.data.to_dict(),
        "trust": _trust(result).to_dict(),
        "notes": list(result.notes),
        **({} if result.coupling is None else {"coupling": result.coupling.to_dict()}),
        "seed": result.seed,
        "evaluations": result.evaluations,
        "failures": dict(result.failures),
        "declared_fmu": {"path": str(result.fmu), "sha256": result.fmu_sha256},
        "scenario": str(result.scenario),
        "version": result.version,
    }


def _trust(result: DiagnosisResult) -> Trust:
    """Whether what is left is noise, and does not depend on a communication step."""
    left = judge_ratios(_ratios(result.after if result.after["fit"] else result.before))
    return Trust.of((*left.reasons, result.coupling.reason if result.coupling is not None else ""))


def _ratios(errors: Errors) -> dict[str, float]:
    """rmse over noise of every fitted signal."""
    return {name: e.rmse / e.noise for name, e in errors["fit"].items() if e.noise > 0.0}


def write_diagnosis(result: DiagnosisResult, folder: Path) -> list[Path]:
    """Write result.json, candidates.csv, structure.csv, experiment.csv and the signals; the paths."""
    content = diagnosis_json(result, folder)
    files = []
    weighed = [{**c, "parameters": json.dumps(c["parameters"])} for c in content["candidates"]]
    tables = {"candidates.csv": weighed, "structure.csv": [vars(d) for d in result.dependence]}
    for name, rows in tables.items():
        write_csv(folder / name, list(rows[0]) if rows else [], [_cells(list(row.values())) for row in rows])
        files.append(folder / name)
    if result.experiment is not None:
        inputs = result.experiment.inputs
        header = ["time [s]", *(f"{n} [{inputs.units[n]}]" for n in inputs.names)]
        samples = zip(inputs.time.tolist(), *(inputs[n].tolist() for n in inputs.names), strict=True)
        write_csv(folder / "experiment.csv", header, [_cells(sample) for sample in samples])
        files.append(folder / "experiment.csv")
    after = {(c.role, c.recording): c.simulated for c in result.comparisons_after}
    for c in result.comparisons_before:
        variants = {"measured": c.measured, "before": c.simulated}
        if (c.role, c.recording) in after:
            variants["after"] = after[c.role, c.recording]
        files.append(write_signals(folder, c.role, c.recording, variants))
    files += [p for p in (result.model, result.extended_fmu, result.wrapper) if p is not None]
    if (again := write_extended_scenario(result, folder)) is not None:
        files.append(again)
    write_json(folder / RESULT, content)
    return [*files, folder / RESULT, *write_pictures(folder)]


def _effect(effect: FoundEffect) -> dict[str, Any]:
    return {
        "name": effect.name,
        "title": effect.title,
        "parameters": _values(effect.parameters),
        "equivalent": list(effect.equivalent),
        "probability": effect.probability,
        "order": effect.order,
    }


def _candidate(judged: Judged) -> dict[str, Any]:
    return {
        "name": judged.name,
        "variant": judged.variant,
        "round": judged.round,
        "fit_gain": judged.fit_gain,
        "held_out_gain": judged.held_out_gain,
        "p_value": judged.p_value,
        "parameters": _values(judged.parameters),
        "decision": judged.decision,
        "reason": judged.reason,
    }


def _balance(balance: Balance) -> dict[str, Any]:
    return {
        "equation": balance.equation,
        "unit": balance.unit,
        "rmse": balance.rmse,
        "noise": balance.noise,
        "share": balance.share,
        "at_fault": balance.at_fault,
    }


def _experiment(best: SeparatingExperiment) -> dict[str, Any]:
    """The next experiment: where its profile is, and what is expected of it."""
    sharpened = best.sharpens
    return {
        "name": best.name,
        "rivals": list(best.rivals),
        "distance": best.distance,
        "present": best.present,
        "expected": best.expected,
        "separates": best.separates,
        "sharpens": None
        if sharpened is None
        else {"variable": sharpened.variable, "before": sharpened.before, "after": sharpened.after},
        "seconds": float(best.inputs.time[-1] - best.inputs.time[0]),
        "reached": {name: list(ends) for name, ends in best.reached.items()},
        "file": "experiment.csv",
    }


def _law(law: EmpiricalLaw) -> dict[str, Any]:
    return {
        "slot": law.terms[0].slot,
        "terms": [_term(t) for t in law.terms],
        "held_out_gain": law.held_out_gain,
        "added": law.added,
    }


def _term(term: EmpiricalTerm) -> dict[str, Any]:
    return {
        "slot": term.slot,
        "term": term.term,
        "coefficient": term.coefficient.value,
        "unit": term.coefficient.unit,
        "stderr": term.coefficient.stderr,
        "shapes": _values(term.shapes),
    }


def _rival(law: RivalLaw) -> dict[str, Any]:
    return {"terms": [_term(t) for t in law.terms], "parameters": _values(law.declared)}


def _cells(values: Collection[Any]) -> list[str]:
    """A row of a CSV file: numbers that read back as they are, nothing for what is missing."""
    shown = ["" if v is None else repr(float(v)) if isinstance(v, float) else str(v) for v in values]
    return ["" if text == "nan" else text for text in shown]


def _evidence(found: Evidence) -> dict[str, Any]:
    """The evidence with null where a model says nothing."""
    columns = ("at", "measured", "stderr", "before", "after")
    bins = {name: [None if math.isnan(v) else v for v in getattr(found, name)] for name in columns}
    words = ("equation", "unit", "left", "part", "cause", "cause_unit", "share")
    return {**{name: getattr(found, name) for name in words}, "bins": bins}


def _force(before: ForceBalance, after: ForceBalance | None) -> dict[str, Any]:
    laps = before.repeatability
    return {
        "unit": before.unit,
        "band_Hz": before.band,
        "before": dict(before.rms),
        "after": {} if after is None else dict(after.rms),
        "repeatability": None if math.isnan(laps) else laps,
    }


def _values(values: Mapping[str, Value]) -> dict[str, dict[str, Any]]:
    return {name: _value(v) for name, v in values.items()}


def _value(value: Value) -> dict[str, Any]:
    """A value; without a standard error where there is none, with a reason where it is not determined."""
    known = {
        "value": value.value,
        "unit": value.unit,
        "stderr": value.stderr if math.isfinite(value.stderr) else None,
        "identifiable": value.identifiable,
    }
    return known if value.identifiable else {**known, "reason": value.reason}


def _errors(errors: Errors) -> dict[str, dict[str, dict[str, float]]]:
    return {part: {name: _error(e) for name, e in channels.items()} for part, channels in errors.items()}


def _error(error: StructuredError) -> dict[str, float]:
    return {"rmse": error.rmse, "noise": error.noise, "structure": error.structure}
