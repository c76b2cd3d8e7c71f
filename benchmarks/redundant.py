"""The redundant actuator through every failure: table, pictures of the transients, cost beside the single actuator.

    python benchmarks/redundant.py [FOLDER]

prints the table of docs/redundant-actuator.md and the ratio of CPU times, measured side by side in this run; with a
FOLDER it draws the pictures into it (matplotlib). At −30 °C against 55 kN, a failure 1 s after the start.
"""

import sys
import time
from pathlib import Path

import numpy as np

from thsa_cosim.fmu import Plant, trajectory
from thsa_cosim.signals import Signals

FMUS = Path(__file__).parents[1] / "fmus"
TIME = np.arange(3001) * 1e-3
COMMAND = np.interp(TIME, [0.0, 0.3, 2.4, 2.7], [0.0, 9e-3, 9e-3, 0.0])
INPUTS = Signals(
    TIME, {"v_cmd": COMMAND, "F_load": np.full_like(TIME, 55e3), "T_amb": np.full_like(TIME, -30.0)}
)
NAMES = ("v", "x", "w_A", "w_B", "F_1", "F_2", "active", "P_el", "E_res")
GAINS = {"velocityController.K_p": 0.363, "velocityController.K_i": 2.98}
LANES = {
    "lane A lost": {"laneA.t_loss": 1.0},
    "resolver A lost": {"laneA.t_sensor": 1.0},
    "motor A jammed": {"laneA.t_jam": 1.0},
    "brake A closes": {"laneA.brake.t_stuck": 1.0},
    "brake B does not hold": {"laneB.brake.t_slip": 1.0},
}
PATHS = {
    "brake B does not release": {"laneA.t_loss": 1.0, "laneB.brake.t_stuck": 0.0},
    "both lanes lost": {"laneA.t_loss": 1.0, "laneB.t_loss": 1.0},
    "screw jammed": {"t_jam": 1.0},
    "primary path broken": {"primary.t_rupture": 1.0},
    "output sensor lost": {"t_sensor": 1.0},
}


def table(plant: Plant, courses: list[trajectory.Trajectory]) -> dict[str, Signals]:
    """Run and print every failure."""
    found = {"healthy": plant.run({}, INPUTS, NAMES, TIME)}
    print(
        "failure                    | lane at the end | from [s] | x off healthy [mm] | energy residual | events"
    )
    for name, values in {**LANES, **PATHS}.items():
        run = found[name] = plant.run(values, INPUTS, NAMES, TIME)
        changed = np.flatnonzero(np.diff(run["active"]))
        at = f"{TIME[changed[-1] + 1]:.3f}" if len(changed) else "-"
        off = (run["x"] - found["healthy"]["x"])[-1] * 1e3
        share = np.abs(run["E_res"]).max() / np.trapezoid(np.abs(run["P_el"]), TIME)
        lane = {0: "none: held", 1: "A", 2: "B"}[int(run["active"][-1])]
        print(f"{name:26s} | {lane:15s} | {at:8s} | {off:18.2f} | {share:15.1e} | {courses[-1].events}")
    return found


def cost(runs: int = 200) -> None:
    """CPU time of a second of simulation, single and redundant in turn."""
    cases = {
        "single": ("THSA", GAINS, ("v", "x", "w_m", "i_q", "u_q")),
        "redundant": ("THSA_Redundant", {}, NAMES),
        "redundant, lane A lost": ("THSA_Redundant", LANES["lane A lost"], NAMES),
    }
    spent = dict.fromkeys(cases, float("inf"))
    for _ in range(3):
        for label, (name, values, outputs) in cases.items():
            with Plant.open(FMUS / f"{name}.fmu") as plant:
                plant.run(values, INPUTS, outputs, TIME)
                start = time.process_time()
                for _ in range(runs):
                    plant.run(values, INPUTS, outputs, TIME)
                spent[label] = min(spent[label], (time.process_time() - start) / runs / TIME[-1])
    for label, seconds in spent.items():
        print(
            f"{label}: {seconds * 1e3:.3f} ms CPU a simulated second, {seconds / spent['single']:.2f} x single"
        )


def draw(found: dict[str, Signals], failures: dict[str, dict[str, float]], file: Path) -> None:
    """Position off the healthy one, motor speeds and forces of the paths over time, a column a failure."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(
        3, len(failures), figsize=(2.6 * len(failures), 6.0), sharex=True, sharey="row", squeeze=False
    )
    for column, name in enumerate(failures):
        run, top, middle, low = found[name], *axes[:, column]
        top.plot(TIME, found["healthy"]["x"] * 1e3, "--", color="0.6", label="healthy")
        top.plot(TIME, run["x"] * 1e3, color="C0", label="x")
        middle.plot(TIME, run["w_A"], color="C1", label="motor A")
        middle.plot(TIME, run["w_B"], color="C2", label="motor B")
        low.plot(TIME, run["F_1"] * 1e-3, color="C3", label="primary")
        low.plot(TIME, run["F_2"] * 1e-3, color="C4", label="secondary")
        top.set_title(name, fontsize=9)
        low.set_xlabel("t [s]")
        for axis in axes[:, column]:
            axis.grid(alpha=0.3)
            axis.axvline(1.0, color="0.8", linewidth=0.8)
    for axis, label in zip(axes[:, 0], ("x [mm]", "speed [rad/s]", "force [kN]"), strict=True):
        axis.set_ylabel(label)
        axis.legend(fontsize=7, loc="best")
    figure.tight_layout()
    figure.savefig(file, dpi=75)


def main(arguments: list[str]) -> int:
    """Command line of this module."""
    courses: list[trajectory.Trajectory] = []
    made = trajectory.Course.__init__

    def noted(self: trajectory.Course, *given: object) -> None:
        made(self, *given)  # type: ignore[arg-type]
        courses.append(self.struct)

    trajectory.Course.__init__ = noted  # type: ignore[method-assign]
    with Plant.open(FMUS / "THSA_Redundant.fmu") as plant:
        found = table(plant, courses)
    if arguments:
        folder = Path(arguments[0])
        draw(found, LANES, folder / "redundant-lanes.png")
        draw(found, PATHS, folder / "redundant-paths.png")
    cost()
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
