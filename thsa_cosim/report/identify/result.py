"""``result.json`` of an identification, and its tables as CSV files."""

import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.identify.results import IdentifyResult, LawResult, PointResult
from thsa_cosim.laws import Law
from thsa_cosim.report.files import plain, write_csv
from thsa_cosim.study import ChannelError


def identify_to_dict(result: IdentifyResult) -> dict[str, Any]:
    """Return the result as plain JSON types; numbers that are not finite become null."""
    content: dict[str, Any] = plain(
        {
            "kind": "identify",
            "title": result.title,
            "status": result.status,
            "seed": result.seed,
            "evaluations": result.evaluations,
            "failures": dict(result.failures),
            "fmu": {"path": str(result.fmu), "sha256": result.fmu_sha256},
            "scenario": str(result.scenario),
            "version": result.version,
            "settings": dict(result.settings),
            "planned_points": result.planned_points,
            "points": [_point(point) for point in result.points],
            "laws": {name: _law(law, result) for name, law in result.laws.items()},
            "error": {
                role: {channel: _error(error) for channel, error in channels.items()}
                for role, channels in result.errors.items()
            },
            **({} if result.force is None else {"force_residual": asdict(result.force)}),
            "recordings": [
                {
                    "name": comparison.recording,
                    "role": comparison.role,
                    "temperature_degC": comparison.temperature_degC,
                    "error": {name: _error(error) for name, error in comparison.errors.items()},
                }
                for comparison in result.comparisons
            ],
            "data": result.data.to_dict(),
            "trust": result.trust.to_dict(),
            "notes": list(result.notes),
            **({} if result.coupling is None else {"coupling": result.coupling.to_dict()}),
        }
    )
    return content


def write_parameters_csv(path: Path, result: IdentifyResult) -> None:
    """One row per point and parameter: value, standard error, whether the data determine it and why not."""
    header = ("temperature_degC", "parameter", "value", "stderr", "unit", "identifiable", "reason")
    rows = [
        (
            "" if point.temperature_degC is None else repr(point.temperature_degC),
            name,
            repr(estimate.value),
            "" if estimate.stderr is None else repr(estimate.stderr),
            estimate.unit,
            str(estimate.identifiable).lower(),
            estimate.reason,
        )
        for point in result.points
        for name, estimate in point.parameters.items()
    ]
    write_csv(path, header, rows)


def write_laws_csv(path: Path, result: IdentifyResult, step: float = 1.0) -> None:
    """The laws as a table over temperature, every ``step`` K across the points: value and standard error."""
    temperatures = [p.temperature_degC for p in result.points if p.temperature_degC is not None]
    header = ["temperature_degC"]
    columns: list[list[float]] = []
    if temperatures:
        grid = np.arange(min(temperatures), max(temperatures) + 0.5 * step, step)
        columns.append(grid.tolist())
        for name, law in result.laws.items():
            header += [f"{name} [{law.unit}]", f"{name} stderr [{law.unit}]"]
            columns += [law.law(grid).tolist(), law.law.stderr(grid).tolist()]
    rows = [["" if math.isnan(v) else repr(v) for v in row] for row in zip(*columns, strict=True)]
    write_csv(path, header, rows)


def _point(point: PointResult) -> dict[str, Any]:
    return {
        "temperature_degC": point.temperature_degC,
        "label": point.label,
        "recordings": list(point.recordings),
        "parameters": {
            name: {
                "value": estimate.value,
                "unit": estimate.unit,
                "stderr": estimate.stderr,
                "identifiable": estimate.identifiable,
                **({"reason": estimate.reason} if estimate.reason else {}),
                "lower": estimate.lower,
                "upper": estimate.upper,
            }
            for name, estimate in point.parameters.items()
        },
        "correlation": point.correlation.tolist(),
        "cost": point.cost,
        "cost_per_sample": point.cost_per_sample,
        "terms": dict(point.terms),
        "also": dict(point.also),
        "profiles": {
            name: {
                "values": curve.values.tolist(),
                "costs": curve.costs.tolist(),
                "interval_95": [curve.lower, curve.upper],
            }
            for name, curve in point.profiles.items()
        },
        "evaluations": point.evaluations,
        "converged": point.converged,
        "stopped": point.stopped,
        "polish": point.polished,
        **_local(point),
        "generations": [
            {
                "generation": generation.index,
                "best_cost": generation.best_cost,
                "median_cost": generation.median_cost,
                "spread": generation.spread.tolist(),
                "evaluations": generation.evaluations,
            }
            for generation in point.generations
        ],
    }


def _local(point: PointResult) -> dict[str, Any]:
    """``local``: every local search, with its cost after each step; ``agreed`` of them ended in the best minimum."""
    if not point.local:
        return {}
    return {
        "agreed": sum(search.agrees for search in point.local),
        "local": [
            {
                "start": search.start.tolist(),
                "cost": list(search.history),
                "evaluations": search.evaluations,
                "agrees": search.agrees,
                "ended": search.reason,
            }
            for search in point.local
        ],
    }


def _law(law: LawResult, result: IdentifyResult) -> dict[str, Any]:
    temperatures = [p.temperature_degC for p in result.points if p.temperature_degC is not None]
    if law.between is not None:
        temperatures = np.linspace(*law.between, 9).tolist()
    at = {f"{t:.1f}": float(law.law(t)) for t in temperatures}
    content: dict[str, Any] = {
        "form": law.law.form,
        "coefficients": list(law.law.coefficients),
        "unit": law.unit,
        "at": at,
        "selected_by": "aicc" if law.selected else "scenario",
        "candidates": {candidate.form: candidate.aicc for candidate in law.candidates},
        "covariance": None if law.law.covariance is None else law.law.covariance.tolist(),
        "chi2": law.law.chi2,
        "identifiable": law.determined,
        "doubts": [asdict(doubt) for doubt in law.doubts],
    }
    if law.between is not None:
        content["between"] = list(law.between)
    if law.law.knots:
        content["knots"] = list(law.law.knots)
    if law.published is not None:
        content["published"] = {
            **_coefficients(law.published),
            "doubts": [asdict(doubt) for doubt in law.published_doubts],
        }
        content["largest_deviation"] = {"points": law.deviation, "law": law.law_deviation}
    return content


def _coefficients(law: Law) -> dict[str, Any]:
    return {"form": law.form, "coefficients": list(law.coefficients)}


def _error(error: ChannelError) -> dict[str, Any]:
    return {
        "rmse": error.rmse,
        "nrmse": error.nrmse,
        "noise": error.noise,
        "unit": error.unit,
        "samples": error.samples,
    }
