"""``result.json`` of a tuning, and its tables as CSV files."""

import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.inspection import Trust
from thsa_cosim.scenario.metrics_schema import METRICS
from thsa_cosim.tune import Pareto, ScheduleResult, Scored, Surface, TuneResult
from thsa_cosim.tune.combine import equation_7


def tune_to_dict(result: TuneResult) -> dict[str, Any]:
    """Return the result as plain JSON types; numbers that are not finite become null."""
    scenario = result.scenario
    content: dict[str, Any] = {
        "kind": "tune",
        "title": scenario.title,
        "status": result.status,
        "seed": scenario.seed,
        "evaluations": result.evaluations,
        "failures": dict(result.failures),
        "fmu": {"path": str(result.fmu), "sha256": scenario.fmu.sha256},
        "scenario": str(scenario.path),
        "version": result.version,
        "settings": dict(result.settings),
        "gains": {} if result.after is None else dict(result.after.gains),
        "units": {p.name: p.unit for p in scenario.parameters.parameters},
        "feasible": result.after is not None and result.after.feasible,
        "before": _scored(result.before, result),
        "after": _scored(result.after, result),
        "compare": {scored.name: _scored(scored, result) for scored in result.compare},
        "requirements": [
            {
                "metric": r.name,
                "maximum" if r.upper else "minimum": r.limit,
                "unit": r.unit,
                "hard": r.hard,
                "met": None if result.after is None else result.after.excess[r.name] <= 0.0,
            }
            for r in scenario.requirements
        ],
        "line": None if result.line is None else vars(result.line),
        "pareto": _pareto(result.pareto, result),
        "surface": _surface(result.surface),
        "schedule": _schedule_rows(result),
        "schedule_check": _check(result.schedule),
        "start": start_rows(result),
        "command": {
            "output": scenario.command.output,
            "unit": scenario.cost.unit,
            "input": scenario.command.input,
        },
        "conditions": {axis.name: {"unit": axis.unit, "values": list(axis.values)} for axis in scenario.axes},
        "profiles": [profile.recording.name for profile in scenario.profiles],
        "term_units": term_units(result),
        "groups": [
            {
                "label": group.label,
                "at": dict(group.at),
                "gains": dict(group.gains),
                "cost": group.cost,
                "feasible": group.feasible,
                "stopped": group.stopped,
                "best_cost": [g.best_cost for g in group.generations],
            }
            for group in result.groups
        ],
        # A tuning compares nothing with recordings; it believes its model, unless its communication step decides.
        "data": scenario.data.to_dict(),
        "trust": Trust.of(() if result.coupling is None else (result.coupling.reason,)).to_dict(),
        "notes": list(result.notes),
        **({} if result.coupling is None else {"coupling": result.coupling.to_dict()}),
    }
    plain: dict[str, Any] = _plain(content)
    return plain


def _scored(scored: Scored | None, result: TuneResult) -> dict[str, Any] | None:
    if scored is None:
        return None
    spec = result.scenario.cost
    # Over several conditions these are the worst of each; the parts of equation 7 belong to one condition.
    parts: dict[str, float] = {}
    if len(scored.terms) == 1:
        worst = scored.worst
        steady = worst["steady_state_error"]
        parts = {
            "tracking": worst["tracking"],
            "rise_time": spec.kappa_rise * worst["rise_time"],
            "steady_state_error": spec.kappa_steady * (steady if spec.signed else abs(steady)),
        }
    return {
        "gains": dict(scored.gains),
        **scored.worst,
        "cost": scored.eq7,
        "cost_terms": parts,
        "feasible": scored.feasible,
        "excess": dict(scored.excess),
    }


def term_units(result: TuneResult) -> dict[str, str]:
    """The unit of every term of the cost and the requirements."""
    scenario = result.scenario
    unit = scenario.cost.unit
    units = {name: own for name, (own, _) in METRICS.items() if own and name in result.terms}
    units |= {"tracking": f"({unit})²", "tracking_error": unit}
    for name in result.terms:
        signal = scenario.metrics.effort if name == "effort" else name.partition(".")[2]
        if name == "breakaway_current" and scenario.start is not None:
            signal = scenario.start.current
        if name not in units and signal:
            units[name] = scenario.fmu.variables[signal].unit or "1"
    return units


def start_rows(result: TuneResult) -> list[dict[str, Any]]:
    """The start from rest: one row per set of gains and condition, with the terms of ``[start]``; empty without it."""
    spec = result.scenario.start
    if spec is None:
        return []
    units = {axis.name: axis.unit for axis in result.scenario.axes}
    columns = [(name, result.terms.index(name)) for name in spec.terms]
    return [
        {
            "gains": scored.name,
            **{condition_key(n, units[n]): v for n, v in condition.items()},
            **{name: float(terms[k]) for name, k in columns},
        }
        for scored in (result.before, *result.compare, result.after)
        if scored is not None
        for condition, terms in zip(result.conditions, scored.terms, strict=True)
    ]


def write_start_csv(path: Path, result: TuneResult) -> None:
    """The rows of :func:`start_rows` as a table."""
    rows = start_rows(result)
    cells = [[v if isinstance(v, str) else _cell(v) for v in row.values()] for row in rows]
    write_csv(path, list(rows[0]), cells)


def condition_key(name: str, unit: str) -> str:
    """``temperature_degC`` for a condition in degC, else ``F_load_kN``: what a row of the schedule calls it."""
    return "temperature_degC" if unit == "degC" else f"{name}_{unit}" if unit else name


def _schedule_rows(result: TuneResult) -> list[dict[str, Any]]:
    axes = {axis.name: axis.unit for axis in result.scenario.axes}
    if result.schedule is not None:
        rows = result.schedule.schedule.points()
    elif result.after is not None:
        # One set of gains: a schedule of one point at the conditions that do not vary.
        fixed = {a.name: a.values[0] for a in result.scenario.axes if len(a.values) == 1}
        rows = [{**fixed, **result.after.gains}]
    else:
        return []
    return [
        {condition_key(k, axes[k]) if k in axes else k: value for k, value in row.items()} for row in rows
    ]


def _check(schedule: ScheduleResult | None) -> dict[str, Any] | None:
    if schedule is None or schedule.check is None:
        return None
    return {
        "conditions": len(schedule.check.conditions),
        "smoothing": schedule.smoothing,
        "sets": {
            scored.name: {
                "holds": scored.feasible,
                "worst": dict(scored.worst),
                "cost": scored.eq7,
                "excess": dict(scored.excess),
            }
            for scored in schedule.check.sets
        },
    }


def _pareto(pareto: Pareto | None, result: TuneResult) -> dict[str, Any] | None:
    if pareto is None:
        return None
    names = result.scenario.parameters.names
    return {
        "x": pareto.x_name,
        "y": pareto.y_name,
        "front": [
            {pareto.x_name: x, pareto.y_name: y, **dict(zip(names, values, strict=True))}
            for x, y, values in zip(pareto.x.tolist(), pareto.y.tolist(), pareto.values.tolist(), strict=True)
        ],
    }


def _surface(surface: Surface | None) -> dict[str, Any] | None:
    if surface is None:
        return None
    return {
        "parameters": list(surface.names),
        surface.names[0]: surface.x.tolist(),
        surface.names[1]: surface.y.tolist(),
        "cost": surface.cost.tolist(),
        "equation_7": surface.eq7.tolist(),
    }


def write_check_csv(path: Path, result: TuneResult, schedule: ScheduleResult) -> None:
    """One row per checked condition and set of gains: the condition, the set, its cost and all terms."""
    check = schedule.check
    if check is None:
        return
    axes = {axis.name: axis.unit for axis in result.scenario.axes}
    names = list(check.conditions[0])
    header = [condition_key(n, axes[n]) for n in names]
    rows: list[list[Any]] = []
    for scored in check.sets:
        costs = equation_7(result.scenario, result.terms, scored.terms).tolist()
        for at, cost, terms in zip(check.conditions, costs, scored.terms.tolist(), strict=True):
            rows.append([*(repr(at[n]) for n in names), scored.name, *map(_cell, (cost, *terms))])
    write_csv(path, [*header, "gains", "cost", *result.terms], rows)


def write_pareto_csv(path: Path, result: TuneResult, pareto: Pareto) -> None:
    """The non-dominated gains with their two terms."""
    names = result.scenario.parameters.names
    columns = np.column_stack([pareto.x, pareto.y, pareto.values]).tolist()
    write_csv(path, [pareto.x_name, pareto.y_name, *names], [[_cell(v) for v in row] for row in columns])


def write_csv(path: Path, header: list[str], rows: list[list[Any]]) -> None:
    """Write a table."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(rows)


def _cell(value: float) -> str:
    return "" if math.isnan(value) else repr(float(value))


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
