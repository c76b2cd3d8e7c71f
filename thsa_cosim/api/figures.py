"""Figures of a study for notebooks: matplotlib, without its global state."""

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from thsa_cosim.laws import Law
from thsa_cosim.report.identify.plots import MEASURED, PUBLISHED, RESIDUAL, SIMULATED
from thsa_cosim.report.signal_files import SignalFile

if TYPE_CHECKING:
    from thsa_cosim.api.kinds import IdentifyStudy, TuneStudy

_COLOURS = {"measured": MEASURED, "command": MEASURED, "simulated": SIMULATED, "before": PUBLISHED}


class Drawing(Figure):
    """A matplotlib figure that notebooks show without ``%matplotlib``; ``savefig`` writes it to a file."""

    def _repr_png_(self) -> bytes:
        if self.canvas is None or not isinstance(self.canvas, FigureCanvasAgg):
            FigureCanvasAgg(self)
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=100)
        return buffer.getvalue()


def laws(study: "IdentifyStudy", names: Sequence[str]) -> Drawing:
    """Points with 95 % intervals, the fitted law with its band, and the published one, over temperature."""
    columns = min(2, len(names))
    rows = -(-len(names) // columns)
    figure = Drawing(figsize=(6.0 * columns, 3.8 * rows), layout="constrained")
    parameters = study.parameters
    for k, name in enumerate(names):
        axes = figure.add_subplot(rows, columns, k + 1)
        points = parameters.xs(name, level="parameter")
        t = np.array(points.index, dtype=np.float64)
        grid = np.linspace(t.min() - 2.0, t.max() + 2.0, 200)
        law, content = study.law(name), study.result["laws"][name]
        curve, band = law(grid), 1.96 * law.stderr(grid)
        if np.isfinite(band).all():
            axes.fill_between(grid, curve - band, curve + band, color=SIMULATED, alpha=0.15, lw=0)
        axes.plot(grid, curve, color=SIMULATED, label=f"fitted ({law.form})")
        if published := content.get("published"):
            known = Law(published["form"], tuple(published["coefficients"]))
            axes.plot(grid, known(grid), "--", color=PUBLISHED, label="published")
        errors = 1.96 * points["stderr"].astype(float).fillna(0.0).to_numpy()
        values = points["value"].to_numpy(dtype=float)
        axes.errorbar(
            t, values, yerr=errors, fmt="o", ms=4, capsize=3, color="black", label="identified, 95 %"
        )
        _label(axes, "temperature [°C]", f"{name} [{content['unit']}]")
        axes.legend(frameon=False, fontsize=9)
    return figure


def recording(found: SignalFile) -> Drawing:
    """Every signal of a recording over time; what differs from the measured or commanded one below it."""
    references = {name: v.get("measured", v.get("command")) for name, v in found.channels.items()}
    heights = [h for reference in references.values() for h in ((3,) if reference is None else (3, 1))]
    figure = Drawing(figsize=(9.0, 0.75 * sum(heights)), layout="constrained")
    panels = iter(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights, squeeze=False)[:, 0])
    for name, variants in found.channels.items():
        above, unit, reference = next(panels), found.units.get(name, "1"), references[name]
        for variant, values in variants.items():
            above.plot(found.time, values, lw=0.9, color=_COLOURS.get(variant), label=variant)
        _label(above, "", f"{name} [{unit}]")
        above.legend(frameon=False, fontsize=9, ncols=4, loc="lower right", bbox_to_anchor=(1.0, 0.98))
        if reference is None:
            continue
        below = next(panels)
        for variant, values in variants.items():
            if values is not reference:
                colour = RESIDUAL if variant == "simulated" else _COLOURS.get(variant)
                below.plot(found.time, values - reference, lw=0.6, color=colour)
        _label(below, "", f"difference\n[{unit}]")
    figure.axes[-1].set_xlabel("time [s]")
    figure.suptitle(found.name)
    return figure


def convergence(searches: Mapping[str, Sequence[float]], label: str) -> Drawing:
    """Best cost against the generation of an evolution, or the step of a local search; one line a search."""
    figure = Drawing(figsize=(7.0, 4.4), layout="constrained")
    axes = figure.add_subplot()
    for name, costs in searches.items():
        axes.plot(range(len(costs)), costs, marker=".", lw=1.0, label=name)
    axes.set_yscale("log")
    _label(axes, "generation or step [1]", label)
    axes.legend(frameon=False, fontsize=8)
    return figure


def schedule(study: "TuneStudy") -> Drawing:
    """Every gain over the schedule's first condition, one line for each value of the second."""
    table, units = study.schedule, study.result["units"]
    conditions = [name for name in table.columns if name not in units]
    figure = Drawing(figsize=(5.2 * len(units), 3.8), layout="constrained")
    panels = figure.subplots(1, len(units), squeeze=False)[0]
    families = [("", table)]
    if len(conditions) > 1:
        families = [(f"{conditions[1]} = {v:g}", rows) for v, rows in table.groupby(conditions[1])]
    for axes, (name, unit) in zip(panels, units.items(), strict=True):
        for label, rows in families:
            axes.plot(rows[conditions[0]], rows[name], "o-", ms=4, lw=1.2, label=label)
        _label(axes, conditions[0], f"{name} [{unit}]")
        if len(conditions) > 1:
            axes.legend(frameon=False, fontsize=8)
    return figure


def _label(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(True, color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
