"""The article's figures from our studies, with measured points: PNG files of less than 150 kB."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pyarrow.parquet as pq
from article_numbers import (
    EFFICIENCY_AT,
    GEAR_RATIO,
    LEAD,
    SPEEDS,
    TABLES,
    TEMPERATURES,
    FloatArray,
    Json,
    friction_points,
    load_torque,
    motor_of,
    published,
    ramp,
    start_numbers,
)
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from thsa_cosim.efficiency import motor_efficiency
from thsa_cosim.laws import COPPER
from thsa_cosim.report.identify.parameters import read_law

mpl.use("Agg")
mpl.rcParams.update(
    {
        "font.size": 9,
        "axes.grid": True,
        "grid.alpha": 0.3,
        "axes.spines.top": False,
        "axes.spines.right": False,
    }
)
MEASURED, OURS, ARTICLE, THIRD = "0.55", "#c0392b", "#1f4e79", "#2e7d32"


def draw_all(folders: dict[str, Path], results: dict[str, Json], target: Path) -> None:
    """Write every picture of the page into ``target``."""
    target.mkdir(parents=True, exist_ok=True)
    laws = results["article"]["laws"]
    _save(_tables(results["article"]), target / "tables.png")
    _save(_friction(laws, "gearbox"), target / "fig7.png")
    _save(_friction(laws, "nut"), target / "fig8.png")
    _save(_validation(folders["article"] / "4_fig10"), target / "fig10.png")
    _save(_gains(folders), target / "fig11.png")
    _save(_efficiency(laws), target / "efficiency.png")
    _save(_start(start_numbers(results["cold_start"], laws)), target / "start.png")
    _save(_population(folders["table4"], results["table4"]), target / "population.png")


def _efficiency(laws_of: Json) -> Figure:
    """The motor's efficiency over shaft torque and speed, with the point of 55 kN at 9 mm/s."""
    laws = {name: read_law(law) for name, law in laws_of.items()}
    torque, speed = np.linspace(0.05, 8.0, 120), np.linspace(2.0, 200.0, 120)
    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    axes = figure.subplots(1, 3, sharey=True)
    filled = None
    for axis, t in zip(axes, EFFICIENCY_AT, strict=True):
        found = motor_efficiency(torque[:, None], speed[None, :], **motor_of(laws, t))
        filled = axis.contourf(speed, torque, found, levels=np.arange(0.0, 1.01, 0.05), cmap="viridis")
        lines = axis.contour(
            speed, torque, found, levels=(0.5, 0.7, 0.8, 0.9), colors="white", linewidths=0.8
        )
        axis.clabel(lines, fontsize=7)
        point = load_torque(laws, t, 55e3, 9e-3)
        axis.plot(9e-3 * GEAR_RATIO / LEAD, point, "o", color=OURS, ms=6, mec="white")
        axis.set(title=f"{t:g} °C".replace("-", "−"), xlabel="speed [rad/s]")
        axis.grid(visible=False)
    axes[0].set_ylabel("shaft torque [N·m]")
    figure.colorbar(filled, ax=axes, label="efficiency of the motor")
    return figure


def _start(rows: list[Json]) -> Figure:
    """Breakaway margin, reserves and start time over temperature, by load."""
    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    axes = figure.subplots(1, 3)
    loads = sorted({row["F_load_kN"] for row in rows})
    for load, colour in zip(loads, (ARTICLE, THIRD, OURS), strict=True):
        own = [row for row in rows if row["F_load_kN"] == load]
        t = [row["temperature_degC"] for row in own]
        label = f"{load:g} kN".replace("-", "−")
        axes[0].plot(t, [row["breakaway_current"] for row in own], "o-", ms=3, color=colour, label=label)
        axes[0].plot(t, [row["static"] for row in own], ":", color=colour)
        axes[1].plot(t, [1e3 * row["start_time"] for row in own], "o-", ms=3, color=colour)
        axes[2].plot(t, [row["current_reserve"] for row in own], "o-", ms=3, color=colour)
        axes[2].plot(t, [row["voltage_reserve"] for row in own], "--", color=colour)
    axes[0].set(ylabel="current [A]", title="breakaway; dotted: static")
    axes[0].legend(frameon=False, fontsize=8)
    axes[1].set(ylabel="time [ms]", title="start time")
    axes[2].set(ylim=(0.0, 1.0), title="reserve: current, dashed: voltage")
    for axis in axes:
        axis.set_xlabel("temperature [°C]")
    return figure


def _save(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=110, bbox_inches="tight")


def _tables(result: Json) -> Figure:
    """Tables II and III: points, identified laws, published laws, and what copper would do."""
    figure = Figure(figsize=(9.0, 9.0))
    axes = figure.subplots(4, 2, sharex=True)
    t = np.linspace(-55.0, 25.0, 161)
    for axis, (name, (_, _, unit)) in zip(axes.flat, TABLES.items(), strict=True):
        points = [p for p in result["points"] if name in p["parameters"]]
        at = [p["temperature_degC"] for p in points]
        values = [p["parameters"][name]["value"] for p in points]
        errors = [1.96 * (p["parameters"][name]["stderr"] or 0.0) for p in points]
        axis.plot(t, published(name)(t), "--", color=ARTICLE, label="article", lw=1.2)
        axis.plot(t, read_law(result["laws"][name])(t), color=OURS, label="identified law", lw=1.2)
        axis.errorbar(at, values, errors, fmt="o", ms=3.5, color="black", label="identified, 95 %", lw=0.8)
        if name == "R_s":
            copper = values[-1] * (1.0 + COPPER * (t - 20.0)) / (1.0 + COPPER * 5.0)
            axis.plot(t, copper, ":", color=THIRD, label="copper, from 25 °C")
            axis.legend(frameon=False, fontsize=8)
        axis.set_ylabel(f"{name} [{unit}]")
    for axis in axes[-1]:
        axis.set_xlabel("temperature [°C]")
    figure.tight_layout()
    return figure


def _friction(laws: Json, element: str) -> Figure:
    """Figures 7 and 8: friction over speed and temperature, the 64 measured points on the identified surface."""
    coulomb, viscous, unit = (
        ("T_fg", "b_g", "N·m at its output shaft") if element == "gearbox" else ("F_fn", "b_n", "N")
    )
    per_mm_s = 1e-3 / LEAD if element == "gearbox" else 1e-3
    measured = friction_points(element)
    speed, t = np.linspace(0.0, 9.5, 80), np.linspace(-57.0, 27.0, 120)
    c, b = read_law(laws[coulomb]), read_law(laws[viscous])
    values = c(t)[:, None] + b(t)[:, None] * speed[None, :] * per_mm_s
    figure = Figure(figsize=(9.0, 3.8))
    plane, cuts = figure.subplots(1, 2)
    levels = MaxNLocator(14).tick_values(min(values.min(), measured.min()), max(values.max(), measured.max()))
    filled = plane.contourf(speed, t, values, levels=levels, cmap="viridis")
    where = np.meshgrid(SPEEDS, TEMPERATURES)
    plane.scatter(
        *where, c=measured, cmap="viridis", vmin=levels[0], vmax=levels[-1], edgecolor="white", lw=0.8, s=26
    )
    figure.colorbar(filled, ax=plane, label=f"friction [{unit}]", ticks=levels[::2])
    plane.set(
        xlabel="speed [mm/s]", ylabel="temperature [°C]", title="circles: measured, in the same colours"
    )
    plane.grid(visible=False)
    _cuts(cuts, measured, lambda at: c(at) + b(at) * speed * per_mm_s, speed)
    cuts.set(
        xlabel="speed [mm/s]", ylabel=f"friction [{unit}]", title="points: measured, lines: identified laws"
    )
    figure.tight_layout()
    return figure


def _cuts(axis: Any, measured: FloatArray, law: Any, speed: FloatArray) -> None:
    """Measured points and laws over speed; labels keep 4 % of the axis apart."""
    colours = mpl.colormaps["viridis"](np.linspace(0.9, 0.0, len(TEMPERATURES)))
    ends = []
    for temperature, row, colour in zip(TEMPERATURES, measured, colours, strict=True):
        line = law(temperature)
        axis.plot(speed, line, color=colour, lw=1.0)
        axis.plot(SPEEDS, row, "o", color=colour, ms=3.5)
        ends.append((float(line[-1]), f"{temperature:g} °C".replace("-", "−")))
    least = 0.045 * (max(ends)[0] - float(measured.min()))
    height = -np.inf
    for end, label in sorted(ends):
        height = max(end, height + least)
        axis.annotate(label, (speed[-1] + 0.1, height), fontsize=7, va="center")
    axis.set_xlim(0.0, 11.0)


def _validation(folder: Path) -> Figure:
    """Figure 10: velocity and current, measured and by the model, and their differences."""
    time, command, velocity, current = ramp("tuned_at_25")
    simulated = pq.read_table(next((folder / "signals" / "validate").glob("*.parquet"))).to_pandas()
    ours = {"v": 1e3 * _column(simulated, "v"), "i_q": _column(simulated, "i_q")}
    figure = Figure(figsize=(9.0, 4.6))
    axes = figure.subplots(2, 2, sharex=True, height_ratios=[2.2, 1.0])
    for k, (name, data, unit, label) in enumerate(
        (("v", velocity, "mm/s", "velocity"), ("i_q", current, "A", "q-axis current"))
    ):
        top, below = axes[:, k]
        if name == "v":
            top.plot(time, command, "--", color="0.3", lw=0.9, label="command")
        top.plot(time[::8], data[::8], ".", color=MEASURED, ms=2.5, label="measured")
        top.plot(time, ours[name], color=OURS, lw=1.2, label="model with identified laws")
        top.set_ylabel(f"{label} [{unit}]")
        top.legend(frameon=False, fontsize=8, loc="lower right")
        below.plot(time, data - ours[name], color=MEASURED, lw=0.4)
        below.set(xlabel="time [s]", ylabel=f"difference [{unit}]")
    figure.tight_layout()
    return figure


def _column(table: Any, name: str) -> FloatArray:
    """The simulated signal ``name`` of a study's file of signals."""
    return np.asarray(table[f"{name}.simulated"].to_numpy(dtype=np.float64))


def _gains(folders: dict[str, Path]) -> Figure:
    """Figure 11: the response with the gains of 25 °C and with the optimized ones, measured and by the model."""
    figure = Figure(figsize=(9.0, 3.8))
    whole, near = figure.subplots(1, 2)
    for name, stage, label, colour in (
        ("tuned_at_25", "4_fig10", "tuned at 25 °C (0.12, 0.45)", ARTICLE),
        ("optimized", "5_fig11", "optimized at −30 °C (0.363, 2.98)", OURS),
    ):
        time, command, velocity, _ = ramp(name)
        simulated = pq.read_table(
            next((folders["article"] / stage / "signals" / "validate").glob("*.parquet"))
        ).to_pandas()
        for axis in (whole, near):
            axis.plot(time[::5], velocity[::5], ".", color=colour, ms=2.5, alpha=0.35)
            axis.plot(time, 1e3 * _column(simulated, "v"), color=colour, lw=1.3, label=label)
    for axis in (whole, near):
        axis.plot(time, command, "--", color="0.3", lw=0.9, label="command")
        axis.set(xlabel="time [s]", ylabel="velocity [mm/s]")
    whole.set_xlim(0.0, 1.2)
    near.set(xlim=(0.2, 0.7), ylim=(7.5, 9.5), title="around 95 % of the command")
    near.axhline(0.95 * 9.0, color="0.6", lw=0.8)
    whole.set_title("points: measured, lines: model with identified laws")
    whole.legend(frameon=False, fontsize=8, loc="lower right")
    figure.tight_layout()
    return figure


def _population(folder: Path, result: Json) -> Figure:
    """How the population of the article's differential evolution draws together in the plane of the gains."""
    import pandas as pd

    rows = pd.read_csv(folder / "journal.csv")
    rows = rows[(rows["stage"] == "all conditions") & (rows["index"] >= 0)].sort_values("index")
    size = 45
    figure = Figure(figsize=(9.0, 3.4))
    axes = figure.subplots(1, 3, sharex=True, sharey=True)
    for axis, generation in zip(axes, (0, 10, 30), strict=True):
        seen = rows.iloc[: size * (generation + 1)]
        last = seen.iloc[-size:]
        axis.loglog(last["K_p"], last["K_i"], "o", ms=3, color=OURS, label="trial vectors")
        _lines(axis, result)
        axis.set(title=f"generation {generation}", xlabel="K_p [A/(rad/s)]")
    axes[0].set_ylabel("K_i [A/rad]")
    axes[0].legend(frameon=False, fontsize=7, loc="lower right")
    figure.tight_layout()
    return figure


def _lines(axis: Any, result: Json) -> None:
    across = np.array([0.03, 3.0])
    axis.plot(across, across / 0.1218, "--", color=ARTICLE, lw=1.0, label="article: K_p/K_i = 0.1218")
    ratio = result["line"]["ratio"]
    axis.plot(across, across / ratio, ":", color=THIRD, lw=1.2, label=f"here: {ratio:.3f}")
    axis.set(xlim=(0.03, 3.0), ylim=(0.1, 30.0))
