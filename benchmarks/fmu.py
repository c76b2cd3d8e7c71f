"""Our FMU's Co-Simulation against fmpy's Model Exchange with CVode, on the same FMU at the same accuracy.

    python benchmarks/fmu.py [fmus/THSA.fmu]

The command, the load and the temperature are constant (a speed step under load, no reversal), because fmpy's Model
Exchange holds inputs over its output interval, an error that has nothing to do with the solver. Every solver runs at
several tolerances; its error is the largest deviation of v, x, w_m, i_q and u_q, relative to each signal's range, from
an independent integration of the hand-written equations (``tests/reference``, SciPy's Radau at 1e-10). Each is judged
by its fastest run whose error is at most 1e-5. Times are CPU seconds, medians of runs that take turns; unpacking and
parsing are done once and not counted.
"""

import argparse
import ctypes
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu

from thsa_cosim.fmu import Plant

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from reference.radau import simulate
from reference.rig import Widths, rig_at
from reference.waves import constant

OUTPUTS = ("v", "x", "w_m", "i_q", "u_q")
VALUES = {"v_cmd": 9e-3, "F_load": 55e3, "T_amb": -30.0}
STOP, STEP, GOAL, STAGES = 3.0, 1e-3, 1e-5, 8


def error(got: np.ndarray, reference: np.ndarray) -> float:
    """Largest deviation relative to each signal's range; arrays (n, signals)."""
    return float(np.max(np.abs(got - reference).max(axis=0) / np.ptp(reference, axis=0)))


LOOP = """
#include "model.h"
#if defined(_WIN32)
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
double evaluate(long repeats, int jacobian, const double *x, const double *u, const double *m) {
  double d[N_D + N_CACHE + 1], y[N_X + 1], f[N_X + 1], A[N_X * N_X + 1], B[N_X * N_U + 1], sum = 0;
  model_dependent(model_p_start, d);
  for (int i = 0; i < N_X; i++) y[i] = x[i];
  for (long k = 0; k < repeats; k++) {
    y[0] = x[0] + 1e-12 * (double)k;
    if (jacobian) { model_jacobian(0, y, u, model_p_start, d, m, A, B, f); sum += A[0]; }
    else { model_rhs(0, y, u, model_p_start, d, m, f); sum += f[0]; }
  }
  return sum;
}
"""


def evaluation_seconds(folder: str) -> tuple[float, float]:
    """Seconds per right-hand side and per Jacobian, from the C sources inside the FMU, in a C loop."""
    from thsa_cosim.export.compile import PLATFORMS, compile_library

    suffix = {"linux": ".so", "darwin": ".dylib", "win32": ".dll"}[sys.platform]
    platform = next(p for p in PLATFORMS if p.suffix == suffix)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch:
        sources = Path(scratch) / "sources"
        shutil.copytree(Path(folder) / "sources", sources)
        (sources / "loop.c").write_text(LOOP)
        compile_library(sources, ["loop.c", "model.c"], platform, Path(scratch) / f"loop{suffix}")
        evaluate = ctypes.CDLL(str(Path(scratch) / f"loop{suffix}")).evaluate
        evaluate.argtypes = [ctypes.c_long, ctypes.c_int, *3 * [ctypes.c_void_p]]
        evaluate.restype = ctypes.c_double
        x, u, m = (np.zeros(200) for _ in range(3))
        u[:3] = list(VALUES.values())
        seconds = []
        for jacobian, repeats in ((0, 300_000), (1, 100_000)):
            best = np.inf
            for _ in range(5):
                start = time.perf_counter()
                evaluate(repeats, jacobian, x.ctypes.data, u.ctypes.data, m.ctypes.data)
                best = min(best, (time.perf_counter() - start) / repeats)
            seconds.append(best)
    return seconds[0], seconds[1]


def independent(grid: np.ndarray, plant: Plant) -> dict[str, np.ndarray]:
    """Outputs of the reference plant with the FMU's regularisation, each (n,)."""
    start = {name: variable.start for name, variable in plant.description.variables.items()}
    widths = Widths(
        motor=start["motor.friction.v_r"],
        gearbox=start["gearbox.friction.v_r"],
        nut=start["nut.friction.v_r"],
        hold_current=start["velocityController.I_band"],
        hold_voltage=start["currentController.U_band"],
    )
    return simulate(
        rig_at(VALUES["T_amb"]), constant(VALUES["v_cmd"]), constant(VALUES["F_load"]), grid, widths
    )


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("fmu", nargs="?", type=Path, default=Path("fmus/THSA.fmu"))
    parser.add_argument("--turns", type=int, default=5)
    options = parser.parse_args()
    grid = np.arange(round(STOP / STEP) + 1) * STEP
    description = read_model_description(str(options.fmu))
    folder = extract(str(options.fmu))

    with Plant.open(options.fmu) as plant:

        def ours(tolerance: float) -> np.ndarray:
            got = plant.run(VALUES, None, OUTPUTS, grid, tolerance=tolerance)
            return np.column_stack([got[name] for name in OUTPUTS])

        def fmpy_cvode(tolerance: float) -> np.ndarray:
            got = simulate_fmu(
                folder,
                validate=False,
                model_description=description,
                fmi_type="ModelExchange",
                stop_time=STOP,
                output_interval=STEP,
                relative_tolerance=tolerance,
                start_values=VALUES,
                output=OUTPUTS,
            )
            on_grid = np.searchsorted(
                got["time"], grid - 1e-9
            )  # events add rows; the last of a pair is after it
            return np.column_stack([got[name][np.minimum(on_grid, len(got) - 1)] for name in OUTPUTS])

        expected = independent(grid, plant)
        reference = np.column_stack([expected[name] for name in OUTPUTS])
        candidates = [("co-simulation", ours, 10.0**-k) for k in (4, 5, 6, 7, 8)]
        candidates += [("fmpy ME + CVode", fmpy_cvode, 10.0**-k) for k in (5, 6, 7, 8, 9)]
        errors, times = {}, {}
        for name, run, tolerance in candidates:
            try:
                errors[name, tolerance] = error(run(tolerance), reference)
            except Exception as failure:
                print(f"{name:16s} tolerance {tolerance:.0e}  failed: {failure}")
        for _ in range(options.turns):
            for name, run, tolerance in candidates:
                if (name, tolerance) in errors:
                    start = time.thread_time()
                    run(tolerance)
                    times.setdefault((name, tolerance), []).append(time.thread_time() - start)
    best: dict[str, tuple[float, float, float]] = {}
    for (name, tolerance), values in times.items():
        seconds, off = statistics.median(values), errors[name, tolerance]
        print(
            f"{name:16s} tolerance {tolerance:.0e}  error {off:.1e}  {1e3 * seconds:9.2f} ms a run of {STOP:g} s"
        )
        if off <= GOAL and (name not in best or seconds < best[name][0]):
            best[name] = (seconds, tolerance, off)
    for name, (seconds, tolerance, off) in best.items():
        print(f"chosen {name}: tolerance {tolerance:.0e}, error {off:.1e}, {1e3 * seconds:.2f} ms")
    if len(best) == 2:
        print(f"vs_fmpy_cvode {best['fmpy ME + CVode'][0] / best['co-simulation'][0]:.1f}")
    seconds = best["co-simulation"][0]
    right_hand_side, jacobian = evaluation_seconds(folder)
    steps = len(grid) - 1
    spent = steps * (STAGES * right_hand_side + jacobian)
    print(
        f"one step of the solver {1e6 * seconds / steps:.2f} us: {STAGES} right-hand sides of "
        f"{1e9 * right_hand_side:.0f} ns, one Jacobian of {1e9 * jacobian:.0f} ns"
    )
    print(f"rhs_share {spent / seconds:.2f}")


if __name__ == "__main__":
    main()
