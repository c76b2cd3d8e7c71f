"""The pictures of the pages on measured drives, from studies of the shipped scenarios.

``python benchmarks/measured_figures.py [-o docs/measured] [--studies FOLDER]`` runs the three diagnoses and two
identifications (about three minutes) into FOLDER, where studies that are finished are kept, and draws servo.png,
cogging.png and compensation.png.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

import thsa_cosim as tc
from thsa_cosim.recordings import Column, TimeAxis, read_recording

mpl.use("Agg")
mpl.rcParams.update(
    {
        "font.size": 8,
        "axes.grid": True,
        "grid.alpha": 0.3,
        "axes.spines.top": False,
        "axes.spines.right": False,
    }
)
ROOT = Path(__file__).resolve().parents[1]
SCENARIOS = ROOT / "scenarios"
MEASURED, DECLARED, EXTENDED = "0.2", "#c77a35", "#1f639b"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "measured")
    parser.add_argument(
        "--studies", type=Path, default=None, help="folder of the studies; default: a temporary one"
    )
    given = parser.parse_args()
    given.output.mkdir(parents=True, exist_ok=True)
    if given.studies is not None:
        draw_all(given.studies, given.output)
        return
    with tempfile.TemporaryDirectory() as folder:
        draw_all(Path(folder), given.output)


def draw_all(studies: Path, target: Path) -> None:
    """Run what is missing in ``studies`` and write every picture into ``target``."""
    for name in ("servo", "cogging", "cogging_speed"):
        run("diagnose", SCENARIOS / f"{name}.toml", studies / name)
    found = studies / "cogging_speed" / "extended.toml"
    for half in ("before", "after"):
        recording = SCENARIOS / "recordings" / f"cogging_{half}.parquet"
        run("identify", found, studies / half, "--fit", str(recording))
    save(servo(tc.open_study(studies / "servo")), target / "servo.png")
    save(cogging(tc.open_study(studies / "cogging")), target / "cogging.png")
    halves = [tc.open_study(studies / half) for half in ("before", "after")]
    save(compensation(*halves), target / "compensation.png")


def run(command: str, scenario: Path, folder: Path, *more: str) -> None:
    """One study into ``folder``, unless it has a result."""
    if not (folder / "result.json").exists():
        line = [sys.executable, "-m", "thsa_cosim.cli", command, str(scenario), "-o", str(folder), *more]
        subprocess.run(line, check=True)


def save(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=100, bbox_inches="tight")
    print(f"written: {path}")


def servo(study: Any) -> Figure:
    """Position in the eight held-out runs: measured, by the declared model, with what the diagnosis added."""
    figure = Figure(figsize=(9.6, 3.9))
    axes = figure.subplots(2, 4, sharex=True)
    names = [n for n in study.files if "kp200" in n or "kp800" in n]
    for axis, name in zip(axes.flat, sorted(names), strict=True):
        table = study.signals(name)
        time = table.index.to_numpy()
        axis.plot(time, column(table, "q", "measured"), color=MEASURED, lw=1.5, label="measured")
        axis.plot(time, column(table, "q", "before"), color=DECLARED, lw=0.9, label="declared model")
        axis.plot(
            time, column(table, "q", "after"), color=EXTENDED, lw=0.9, label="with load-dependent friction"
        )
        _, gain, kind = name.split("_", 2)
        axis.set_title(f"gain {gain.removeprefix('kp')}, {kind}", fontsize=8)
    for axis in axes[:, 0]:
        axis.set_ylabel("position [rad]")
    for axis in axes[1]:
        axis.set_xlabel("time [s]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.tight_layout()
    figure.legend(handles, labels, frameon=False, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 0.99))
    return figure


def cogging(study: Any) -> Figure:
    """Current over one turn of the held-out record, and the amplitude of what is left per order."""
    (name,) = [n for n in study.files if "rolling2" in n]
    table = study.signals(name)
    turns = turns_at(table.index.to_numpy(), SCENARIOS / "recordings" / "cogging_rolling2.parquet")
    figure = Figure(figsize=(9.6, 2.5))
    wave, orders = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
    one = (turns >= 5.0) & (turns < 6.0)
    for source, colour, label in (
        ("measured", MEASURED, "measured"),
        ("before", DECLARED, "declared model"),
        ("after", EXTENDED, "with cogging, orders 12 and 36"),
    ):
        wave.plot(turns[one] - 5.0, column(table, "i_q", source)[one], color=colour, lw=1.0, label=label)
    wave.set(xlabel="turns", ylabel="current [A]", ylim=(0.0, 0.22))
    wave.legend(frameon=False, ncols=3, loc="upper right", fontsize=7)
    number = np.arange(1, 145)
    for source, colour in (("before", DECLARED), ("after", EXTENDED)):
        left = column(table, "i_q", "measured") - column(table, "i_q", source)
        wanted = np.exp(-2j * np.pi * number[:, None] * turns)
        orders.plot(number, 2.0 * np.abs(wanted @ (left - left.mean())) / left.size, color=colour, lw=1.0)
    orders.set(xlabel="periods per turn of the motor", ylabel="amplitude left [A]", xticks=range(0, 145, 12))
    figure.tight_layout()
    return figure


def column(table: Any, signal: str, source: str) -> Any:
    """A signal of a study's table, (n,): its columns are named with the unit, ``(i_q [A], measured)``."""
    (name,) = [n for n in table.columns if n[0].split(" [")[0] == signal and n[1] == source]
    return table[name].to_numpy()


def turns_at(time: Any, file: Path) -> Any:
    """Turns of the motor since its first sample at ``time`` (n,), from the measured angle."""
    columns = {"phi": Column("position", "rad")}
    recorded = read_recording(file, columns, time=TimeAxis("t", "s"), units={"phi": "rad"}).signals
    angle = np.interp(time, recorded.time, recorded["phi"])
    return np.abs(angle - angle[0]) / (2.0 * np.pi)


def compensation(before: Any, after: Any) -> Figure:
    """Measured and simulated speed in 1.5 s before and after the compensation is switched on."""
    figure = Figure(figsize=(9.6, 2.6))
    axes = figure.subplots(1, 2, sharey=True)
    for axis, study, title in zip(
        axes, (before, after), ("before", "after the compensation is switched on"), strict=True
    ):
        table = study.signals(next(iter(study.files)))
        part = table[(table.index >= 1.0) & (table.index <= 2.5)]
        axis.plot(part.index, column(part, "w", "measured"), color=MEASURED, lw=1.0, label="measured")
        label = "model with cogging, identified from this half"
        axis.plot(part.index, column(part, "w", "simulated"), color=EXTENDED, lw=1.0, label=label)
        axis.set(xlabel="time [s]", title=title)
    axes[0].set_ylabel("speed [rad/s]")
    axes[0].set_ylim(top=15.0)
    axes[0].legend(frameon=False, fontsize=7, loc="upper right")
    figure.tight_layout()
    return figure


if __name__ == "__main__":
    main()
