"""Figures of a tuning, as PNG files; no global state of matplotlib is touched."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from thsa_cosim.signals import FloatArray
from thsa_cosim.tune import GroupResult, Pareto, ScheduleResult, Scored, Surface, TuneResult
from thsa_cosim.tune.population import Line

COLOURS = ("#0b62a4", "#c44e2b", "#5b8c5a", "#8a5aa8", "#b08a1e", "0.4")
COMMAND = "0.55"


def plot_responses(result: TuneResult, path: Path) -> None:
    """Command and response, error, and effort of every set of gains, under the first and the last condition."""
    scenario = result.scenario
    sets = [s for s in (result.before, *result.compare, result.after) if s is not None]
    count = len(result.conditions)
    chosen = [0] if count == 1 else [0, count - 1]
    effort = scenario.metrics.effort
    rows = 3 if effort else 2
    figure = Figure(figsize=(6.5 * len(chosen), 2.6 * rows), layout="constrained")
    axes = figure.subplots(rows, len(chosen), sharex=True, squeeze=False)
    command = scenario.command.values / scenario.cost.scale
    time, unit = scenario.command.time, scenario.cost.unit
    for column, k in enumerate(chosen):
        axes[0, column].plot(time, command, "--", color=COMMAND, lw=1.2, label="command")
        for scored, colour in zip(sets, COLOURS, strict=False):
            signals = scored.signals[k]
            if signals is None:
                continue
            response = signals[scenario.command.output] * scenario.command.factor / scenario.cost.scale
            label = _gains_label(scored)
            axes[0, column].plot(time, response, color=colour, lw=1.2, label=label)
            axes[1, column].plot(time, command - response, color=colour, lw=1.0)
            if effort:
                axes[2, column].plot(time, signals[effort], color=colour, lw=1.0)
        where = ", ".join(f"{n} = {v:g} {_unit(result, n)}" for n, v in result.conditions[k].items())
        axes[0, column].set_title(where or scenario.title, fontsize=10)
        axes[0, column].set_ylabel(f"{scenario.command.output} [{unit}]")
        axes[1, column].set_ylabel(f"error [{unit}]")
        if effort:
            axes[2, column].set_ylabel(f"{effort} [{scenario.fmu.variables[effort].unit or '1'}]")
        axes[-1, column].set_xlabel("time [s]")
        axes[0, column].legend(frameon=False, fontsize=8, loc="lower right")
        for row in range(rows):
            _tidy(axes[row, column])
    _save(figure, path)


def plot_surface(surface: Surface, result: TuneResult, path: Path) -> None:
    """Cost over the plane of two gains, infeasible gains grey, with the population's path and the line."""
    figure = Figure(figsize=(7.6, 5.8), layout="constrained")
    axes = figure.add_subplot()
    space = result.scenario.parameters
    x_name, y_name = surface.names
    # Equation 7 is drawn everywhere; where a hard requirement is broken it is greyed.
    level = np.log10(np.where(np.isfinite(surface.eq7) & (surface.eq7 > 0.0), surface.eq7, np.nan))
    if np.isfinite(level).any():
        filled = axes.contourf(surface.x, surface.y, np.ma.masked_invalid(level), levels=24, cmap="viridis_r")
        figure.colorbar(filled, ax=axes, label="log₁₀ of equation 7 [1]")
    broken = np.where(np.isfinite(surface.cost), 0.0, 1.0)
    if broken.any():
        axes.contourf(surface.x, surface.y, broken, levels=[0.5, 1.5], colors=["0.35"], alpha=0.45)
        axes.plot([], [], "s", color="0.35", alpha=0.45, ms=9, label="breaks a hard requirement")
    shown = [k for k in (0, 1, 2, 4, 8, 16, len(surface.populations) - 1) if k < len(surface.populations)]
    for rank, k in enumerate(dict.fromkeys(shown)):
        points = surface.populations[k]
        shade = 0.95 - 0.95 * rank / max(len(shown) - 1, 1)
        axes.plot(
            points[:, 0], points[:, 1], ".", ms=4, color=(1.0, shade, shade * 0.6), label=f"generation {k}"
        )
    best = np.array([p[0] for p in surface.populations])
    axes.plot(best[:, 0], best[:, 1], "-", color="white", lw=1.0, alpha=0.8)
    for scored, marker in zip((result.before, *result.compare, result.after), "svD^*P", strict=False):
        if scored is not None:
            at = [scored.gains[x_name], scored.gains[y_name]]
            axes.plot(*at, marker, ms=9, mfc="none", mec="black", ls="none", label=scored.name)
    if result.line is not None and {result.line.numerator, result.line.denominator} == set(surface.names):
        _draw_line(axes, result.line, surface)
    for name, set_scale in ((x_name, axes.set_xscale), (y_name, axes.set_yscale)):
        set_scale(space[name].scale)
    axes.set_xlim(surface.x[0], surface.x[-1])
    axes.set_ylim(surface.y[0], surface.y[-1])
    axes.set_xlabel(f"{x_name} [{space[x_name].unit}]")
    axes.set_ylabel(f"{y_name} [{space[y_name].unit}]")
    axes.legend(frameon=True, fontsize=7, loc="lower right")
    _save(figure, path)


def _draw_line(axes: Axes, line: Line, surface: Surface) -> None:
    upright = line.numerator == surface.names[0]
    for ratio, style, label in (
        (line.ratio, "-", "of the last generations"),
        (line.published, ":", "published"),
    ):
        if ratio:
            y = surface.x / ratio if upright else surface.x * ratio
            text = f"{line.numerator}/{line.denominator} = {ratio:.4g} ({label})"
            axes.plot(surface.x, y, style, color="black", lw=0.9, label=text)


def plot_convergence(groups: tuple[GroupResult, ...], path: Path) -> None:
    """Best cost against generation, one line per group; infeasible generations are left out."""
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    axes = figure.add_subplot()
    for group in groups:
        costs = np.array([g.best_cost for g in group.generations])
        costs = np.where(costs < 1e9, costs, np.nan)
        axes.plot(range(costs.size), costs, marker=".", lw=1.0, label=group.label)
    axes.set_xlabel("generation [1]")
    axes.set_ylabel("best cost [1]")
    axes.legend(frameon=False, fontsize=8)
    _tidy(axes)
    _save(figure, path)


def plot_pareto(pareto: Pareto, result: TuneResult, path: Path) -> None:
    """All feasible gains that were tried in two terms, and the front."""
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(pareto.all_x, pareto.all_y, ".", ms=3, color="0.7", label="tried and feasible")
    axes.plot(pareto.x, pareto.y, "o-", ms=5, lw=1.2, color=COLOURS[0], label="not dominated")
    axes.set_xlabel(pareto.x_name)
    axes.set_ylabel(pareto.y_name)
    axes.legend(frameon=False, fontsize=9)
    _tidy(axes)
    _save(figure, path)


def plot_schedule(schedule: ScheduleResult, result: TuneResult, path: Path) -> None:
    """Each gain over the first condition: nodes' own optima, smoothed, and the single best set."""
    table, raw = schedule.schedule, schedule.unsmoothed
    figure = Figure(figsize=(5.4 * len(table.gains), 4.2), layout="constrained")
    axes = figure.subplots(1, len(table.gains), squeeze=False)[0]
    x = table.nodes[0]
    for one, (name, values) in zip(axes, table.gains.items(), strict=True):
        columns, own = values.reshape(x.size, -1), raw.gains[name].reshape(x.size, -1)
        for k in range(columns.shape[1]):
            colour = COLOURS[k % len(COLOURS)]
            where = (
                ""
                if len(table.nodes) == 1
                else f" at {table.names[1]} = {table.nodes[1][k]:g} {table.units[1]}"
            )
            one.plot(x, own[:, k], "o", ms=5, mfc="none", color=colour, label=f"own optimum{where}")
            one.plot(x, columns[:, k], "-", lw=1.4, color=colour, label=f"schedule{where}")
        if result.after is not None:
            one.axhline(result.after.gains[name], ls="--", color="0.5", lw=1.0, label="best single set")
        one.set_xlabel(f"{table.names[0]} [{table.units[0]}]")
        one.set_ylabel(f"{name} [{table.gain_units[name]}]")
        one.set_ylim(bottom=0.0)
        one.legend(frameon=False, fontsize=8)
        _tidy(one)
    _save(figure, path)


def plot_check(schedule: ScheduleResult, result: TuneResult, path: Path) -> None:
    """Every required term of the sweep over the schedule's first condition, worst over the others, with its limit."""
    check = schedule.check
    if check is None:
        return
    requirements = [r for r in result.scenario.requirements if r.metric != "peak"]
    requirements = requirements or list(result.scenario.requirements)
    if not requirements:
        return
    name, unit = schedule.schedule.names[0], schedule.schedule.units[0]
    places = np.array([c[name] for c in check.conditions])
    x = np.unique(places)
    figure = Figure(figsize=(10.0, 2.9 * ((len(requirements) + 1) // 2)), layout="constrained")
    axes = figure.subplots((len(requirements) + 1) // 2, 2, squeeze=False).ravel()
    for one, requirement in zip(axes, requirements, strict=False):
        column = result.terms.index(requirement.name)
        for scored, colour in zip(check.sets, COLOURS, strict=False):
            values = scored.terms[:, column]
            values = np.abs(values) if requirement.metric == "steady_state_error" else values
            worst = np.max if requirement.upper else np.min
            y: FloatArray = np.array([worst(values[places == at]) for at in x])
            one.plot(x, y, lw=1.3, color=colour, label=scored.name)
        one.axhline(requirement.limit, color="black", ls=":", lw=1.0, label="limit")
        if requirement.metric == "steady_state_error":
            one.set_yscale("log")
        one.set_ylabel(f"{requirement.name} [{requirement.unit}]")
        one.set_xlabel(f"{name} [{unit}]")
        _tidy(one)
    axes[0].legend(frameon=False, fontsize=8)
    for spare in axes[len(requirements) :]:
        spare.set_axis_off()
    _save(figure, path)


def _gains_label(scored: Scored) -> str:
    return f"{scored.name} ({', '.join(f'{v:.3g}' for v in scored.gains.values())})"


def _unit(result: TuneResult, name: str) -> str:
    return next(axis.unit for axis in result.scenario.axes if axis.name == name)


def _tidy(axes: Axes) -> None:
    axes.grid(True, color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _save(figure: Figure, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=130, format="png")
