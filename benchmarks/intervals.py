"""Do the stated 95 % intervals hold the true values?  python benchmarks/intervals.py [--seeds 40] [--bench motor ...]

Each case: the bench is simulated by the reference plant of the tests (hand-written equations, SciPy; no FMU),
sensor noise with a new seed and quantisation are added, and the scenario of that bench identifies what was
put in. Printed: the share of true values inside value ± 1.96 standard errors, and the spread of the errors
over the stated standard error (1 is right; above: too sure of itself).
"""

import argparse
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

REPO = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(REPO / "tests"))

from reference.radau import simulate_motor
from reference.rig import LAWS, NARROW, rig_at
from reference.waves import Wave

from thsa_cosim.identify import identify
from thsa_cosim.scenario import Executor, load
from thsa_cosim.study import Place

FOUND = {"motor": ("R_s", "psi_pm", "T_fm", "b_m"), "screw": ("F_fn", "b_n"), "gearbox": ("T_fg", "b_g")}
SPEEDS = np.array([0.5, 1.0, 2.0, 3.0, 4.5, 6.0, 7.5, 9.0]) * 1e-3
LEVELS = (0, 20, 60, 120, 180, 120, 60, 20, -20, -60, -120, -180, -60, 0)


def motor_truth(temperature: float) -> dict[str, np.ndarray]:
    """The motor bench: speed steps with ramps of 600 rad/s2, each command held for 1 ms; 1 kHz."""
    times, values = [0.0], [0.0]
    for k, level in enumerate(LEVELS):
        start = 0.7 * k
        times += [start, start + max(1e-3, abs(level - values[-1]) / 600.0)] if k else []
        values += [values[-1], float(level)] if k else []
    time = np.arange(round(0.7 * len(LEVELS) / 1e-3)) * 1e-3
    command = np.round(np.interp(time, times, values), 2)
    found = simulate_motor(rig_at(temperature), Wave(time, command, hold=True), time, NARROW, rtol=1e-7)
    return {
        "time_s": time,
        "speed_command_rad_s": command,
        "motor_speed_rad_s": found["w_m"],
        "q_current_A": found["i_q"],
        "q_voltage_V": found["u_q"],
    }


def force_truth(temperature: float, with_gearbox: bool) -> dict[str, np.ndarray]:
    """The benches driven by the load cell: plateaus of 1 s, both ways, 100 Hz."""
    rig = rig_at(temperature)
    v = np.repeat(np.ravel(np.column_stack([SPEEDS, -SPEEDS])), 100)
    force = rig.F_fn * np.sign(v) + rig.b_n * v
    if with_gearbox:
        force += (rig.T_fg * np.sign(v) + rig.b_g * v / rig.k) / rig.k
    return {"time_s": np.arange(len(v)) * 1e-2, "velocity_mm_s": v * 1e3, "force_kN": force * 1e-3}


NOISE = {  # 1 sigma and quantum, in the column's unit
    "motor_speed_rad_s": (0.2, 0.05),
    "q_current_A": (0.05, 0.01),
    "q_voltage_V": (0.3, 0.1),
    "velocity_mm_s": (0.02, 0.005),
    "force_kN": (0.06, 0.01),
}


def measured(
    truth: Mapping[str, np.ndarray], temperature: float, seed: Sequence[int], correlation: float
) -> pd.DataFrame:
    """What the sensors make of the truth: first-order correlated noise of the stated size, quantised."""
    rng = np.random.default_rng(seed)
    table = {}
    for name, values in truth.items():
        if name not in NOISE:
            table[name] = values
            continue
        sigma, quantum = NOISE[name]
        noise = rng.normal(size=len(values))
        for k in range(1, len(noise)) if correlation else ():
            noise[k] = correlation * noise[k - 1] + np.sqrt(1.0 - correlation**2) * noise[k]
        table[name] = np.round((values + sigma * noise) / quantum) * quantum
    table["temperature_degC"] = temperature + 0.2 * rng.normal(size=len(truth["time_s"]))
    return pd.DataFrame(table)


def run(
    bench: str, temperature: float, seeds: int, workers: int, correlation: float
) -> dict[str, list[float]]:
    """Errors in standard errors, per parameter and seed."""
    truth = motor_truth(temperature) if bench == "motor" else force_truth(temperature, bench == "gearbox")
    errors: dict[str, list[float]] = defaultdict(list)
    for seed in range(seeds):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{bench}.parquet"
            measured(truth, temperature, (sorted(FOUND).index(bench), seed), correlation).to_parquet(path)
            scenario = load(REPO / "scenarios" / f"{bench}.toml", fit=[path], seed=seed)
            # The polish ends in the same minimum from a shorter search.
            short = scenario.search.model_copy(update={"population": 12, "generations": 5})
            result = identify(
                replace(scenario, search=short), Place(Path(folder) / "study", Executor(workers))
            )
        found = result.points[0].parameters
        for name in FOUND[bench]:
            stderr = found[name].stderr
            error = found[name].value - LAWS[name](temperature)
            errors[name].append(np.inf if stderr is None else error / stderr)
    return errors


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--bench", choices=sorted(FOUND), nargs="*", default=sorted(FOUND))
    parser.add_argument("--temperature", type=float, default=-30.0, help="degC")
    parser.add_argument(
        "--correlation", type=float, default=0.0, help="of neighbouring noise samples, 0 to 1"
    )
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    inside = total = 0
    print(
        f"{'bench':8s} {'parameter':9s} {'inside 95 %':>12s} {'spread':>7s} {'mean':>7s}   of {options.seeds} seeds"
    )
    for bench in options.bench:
        begin = time.perf_counter()
        for name, errors in run(
            bench, options.temperature, options.seeds, options.workers, options.correlation
        ).items():
            z = np.array(errors)
            hits = int(np.sum(np.abs(z) <= 1.96))
            inside, total = inside + hits, total + len(z)
            print(
                f"{bench:8s} {name:9s} {hits / len(z):12.3f} {np.sqrt(np.mean(z**2)):7.2f} {np.mean(z):7.2f}"
            )
        print(f"{'':8s} {time.perf_counter() - begin:.0f} s", flush=True)
    print(f"true values inside the stated 95 % intervals: {inside} of {total} = {inside / total:.3f}")
    return 0 if inside >= 0.9 * total else 1


if __name__ == "__main__":
    sys.exit(main())
