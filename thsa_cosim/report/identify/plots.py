"""Figures of an identification, as PNG files; no global state of matplotlib is touched."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from thsa_cosim.identify.results import Comparison, IdentifyResult, LawResult

MEASURED = "0.55"
SIMULATED = "#0b62a4"
PUBLISHED = "#c44e2b"
RESIDUAL = "#5b8c5a"


def plot_law(law: LawResult, result: IdentifyResult, path: Path) -> None:
    """Points with 95 % error bars, the fitted law with its band, and the published curve."""
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    _draw_law(figure.add_subplot(), law, result)
    _save(figure, path)


def plot_laws(result: IdentifyResult, path: Path) -> None:
    """All laws of an identification on one sheet."""
    laws = list(result.laws.values())
    columns = min(2, len(laws))
    rows = -(-len(laws) // columns)
    figure = Figure(figsize=(6.0 * columns, 3.9 * rows), layout="constrained")
    for k, law in enumerate(laws):
        _draw_law(figure.add_subplot(rows, columns, k + 1), law, result)
    _save(figure, path)


def _draw_law(axes: Axes, law: LawResult, result: IdentifyResult) -> None:
    points = [p for p in result.points if p.temperature_degC is not None]
    t = np.array([p.temperature_degC for p in points], dtype=np.float64)
    estimates = [p.parameters[law.parameter] for p in points]
    values = np.array([e.value for e in estimates])
    errors = np.array([np.nan if e.stderr is None else e.stderr for e in estimates])
    sure = np.array([e.identifiable for e in estimates], dtype=np.bool_)
    margin = max(0.05 * float(np.ptp(t)), 1.0)
    grid = np.linspace(float(t.min()) - margin, float(t.max()) + margin, 300)
    if law.published is not None:
        axes.plot(grid, law.published(grid), "--", color=PUBLISHED, lw=1.6, label="published")
    curve, band = law.law(grid), 1.96 * law.law.stderr(grid)
    if np.isfinite(band).all():
        axes.fill_between(grid, curve - band, curve + band, color=SIMULATED, alpha=0.15, lw=0)
    axes.plot(grid, curve, color=SIMULATED, lw=1.4, label=f"fitted ({law.law.form})")
    for chosen, face, label in (
        (sure, "black", "identified, 95 %"),
        (~sure, "white", "not determined, 95 %"),
    ):
        if chosen.any():
            axes.errorbar(
                t[chosen],
                values[chosen],
                yerr=1.96 * np.nan_to_num(errors[chosen]),
                fmt="o",
                ms=5,
                mfc=face,
                capsize=3,
                color="black",
                label=label,
            )
    axes.set_xlabel("temperature [°C]")
    axes.set_ylabel(f"{law.parameter} [{law.unit}]")
    title = f"{law.parameter} over temperature"
    if not law.determined:
        title += " (not determined by these data)"
    elif law.deviation is not None:
        title += f" (largest deviation of the points {100.0 * law.deviation:.2g} %)"
    axes.set_title(title, fontsize=11)
    axes.legend(frameon=False)
    _tidy(axes)


def plot_comparison(comparison: Comparison, path: Path) -> None:
    """Measured against simulated for every channel of a recording, each with its residual below."""
    names = comparison.measured.names
    figure = Figure(figsize=(10.0, 3.4 * len(names)), layout="constrained")
    axes = figure.subplots(2 * len(names), 1, sharex=True, height_ratios=[3, 1] * len(names), squeeze=False)
    time = comparison.measured.time
    for k, name in enumerate(names):
        above, below = axes[2 * k, 0], axes[2 * k + 1, 0]
        unit, error = comparison.measured.units[name], comparison.errors[name]
        measured, simulated = comparison.measured[name], comparison.simulated[name]
        above.plot(time, measured, color=MEASURED, lw=0.8, label="measured")
        above.plot(time, simulated, color=SIMULATED, lw=1.0, label="simulated")
        above.set_ylabel(f"{name} [{unit}]")
        above.set_title(
            f"{name}: rmse {error.rmse:.3g} {unit}, {100.0 * error.nrmse:.2g} % of range,"
            f" noise {error.noise:.3g} {unit}",
            fontsize=10,
            loc="left",
        )
        above.legend(frameon=False, loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2, fontsize=9)
        below.plot(time, simulated - measured, color=RESIDUAL, lw=0.6)
        below.axhline(0.0, color="black", lw=0.6)
        below.set_ylabel(f"error\n[{unit}]")
        _tidy(above)
        _tidy(below)
    axes[-1, 0].set_xlabel("time [s]")
    figure.suptitle(comparison.recording, fontsize=12)
    _save(figure, path)


def plot_convergence(result: IdentifyResult, path: Path) -> None:
    """Cost per sample against the step of each local search, or against generation; one colour per point."""
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    axes = figure.add_subplot()
    what = set()
    for k, point in enumerate(result.points):
        scale = point.cost_per_sample / point.cost if point.cost else 1.0
        best = [generation.best_cost for generation in point.generations]
        lines = [best] if best else [search.history for search in point.local]
        what.add("generation" if best else "step of a local search")
        for j, line in enumerate(lines):
            cost = [value * scale for value in line]
            label = point.label if j == 0 else "_"
            axes.plot(range(len(cost)), cost, marker=".", lw=1.0, color=f"C{k}", label=label)
    axes.set_yscale("log")
    axes.set_xlabel(f"{' or '.join(sorted(what))} [1]")
    axes.set_ylabel("best cost per sample [1] (1: noise)")
    axes.legend(frameon=False, fontsize=9)
    _tidy(axes)
    _save(figure, path)


def _tidy(axes: Axes) -> None:
    axes.grid(True, color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _save(figure: Figure, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=130, format="png")
