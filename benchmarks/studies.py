"""What a whole study costs, where it goes, and what the strongest script of a user costs beside it.

    python benchmarks/studies.py [SCENARIO ...] [--script-points 8] [--output DIR]

Each shipped scenario runs from the import to the page, in a process of its own with one worker, as its command
does, with the package's bytecode compiled beforehand, as an installation has it. Printed per study, in CPU seconds:
all of it; import; the parent (search, linear algebra, journal); workers; the report (tables, pictures, page);
export; and the bare FMU: as many simulations as the study had, each as long as one takes alone in a compiled
process (of a diagnosis: of the declared model; the superset takes longer). ``total/FMU`` is the first over the
last; ``search/FMU`` leaves out import, report, and what it takes to start a Python with NumPy for the worker. The
first line is the floor: a Python that imports what any study needs, and one with NumPy alone. Of motor, screw and
gearbox, `script_least_squares.py` then identifies the first ``--script-points`` temperatures from the same arrays;
``script/ours`` compares CPU seconds per temperature, ours with everything included; ``cost`` says by how much the
script's final cost lies above ours, and the last figure how far its values lie from ours at most, in our standard
errors. Of tunings with one set of
gains, `script_tuning.py` searches until it has our final cost. EMPS needs DATA_EMPS.mat in ``../shared/emps``. A
scenario without recordings, or whose command refuses it, is named with the reason.
"""

import argparse
import compileall
import json
import os
import pickle
import resource
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
# The benchmark next door is called coverage.py, and numba imports a package of that name.
sys.path[:] = [entry for entry in sys.path if Path(entry or ".").resolve() != HERE]

SCENARIOS = HERE.parent / "scenarios"
#: The quick ones first.
FIRST = ("motor", "screw", "gearbox", "table4", "driven")
SHIPPED = (*FIRST, *sorted({path.stem for path in SCENARIOS.glob("*.toml")} - set(FIRST)))
EMPS = HERE.parent.parent / "shared" / "emps" / "DATA_EMPS.mat"
#: Scenarios beside which a script runs.
IDENTIFIED, TUNED = ("motor", "screw", "gearbox"), ("table4", "feedforward")
#: What counts as report, and as export: functions by the room they are in.
REPORT = (
    ("thsa_cosim.report.identify.files", "write_identify"),
    ("thsa_cosim.report.tune.files", "write_tune"),
    ("thsa_cosim.report.diagnose.result", "write_diagnosis"),
    ("thsa_cosim.report.simulate.files", "write_simulate"),
    ("thsa_cosim.report.staged", "write_staged"),
    ("thsa_cosim.report.page.write", "write_page"),
)
EXPORT = (("thsa_cosim.export", "export_fmu"),)


def command(name: str) -> str:
    """The command of a scenario: its kind."""
    kind: str = tomllib.loads((SCENARIOS / f"{name}.toml").read_text(encoding="utf-8"))["kind"]
    return kind


def one(name: str, folder: Path) -> dict[str, Any]:
    """Run one study in this process and say where its CPU seconds went."""
    from thsa_cosim.cli import run_command

    spent = {"report": 0.0, "export": 0.0}
    imported = time.process_time()
    import thsa_cosim.export
    import thsa_cosim.identify
    import thsa_cosim.scenario  # noqa: F401

    imported = time.process_time() - imported
    for part, places in (("report", REPORT), ("export", EXPORT)):
        for module, function in places:
            _clocked(module, function, part, spent)
    runs = _counted()
    data = ["--fit", str(EMPS)] if name == "emps" else []
    code = run_command(
        [
            command(name),
            str(SCENARIOS / f"{name}.toml"),
            *data,
            "-o",
            str(folder),
            "--workers",
            "1",
            "--quiet",
        ]
    )
    own, children = (resource.getrusage(w) for w in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    whole, workers = own.ru_utime + own.ru_stime, children.ru_utime + children.ru_stime
    parent = whole - imported - spent["report"] - spent["export"]
    return {
        "code": code, "runs": runs[0], "import": imported, "parent": parent, "workers": workers, **spent
    }  # fmt: skip


def _counted() -> list[int]:
    """Count the simulations that local workers are given from now on."""
    from thsa_cosim.batch.local import LocalRunner

    runs, inner = [0], LocalRunner.run

    def run(self: LocalRunner, jobs: Any, on_outcome: Any = None) -> Any:
        runs[0] += len(jobs)
        return inner(self, jobs, on_outcome)

    LocalRunner.run = run  # type: ignore[method-assign]
    return runs


def _clocked(module: str, function: str, part: str, spent: dict[str, float]) -> None:
    """Let a function add its CPU seconds to ``spent``; one that a kind does not have is left out."""
    import importlib

    try:
        room = importlib.import_module(module)
        inner: Callable[..., Any] = getattr(room, function)
    except (ImportError, AttributeError):
        return

    def clocked(*arguments: Any, **named: Any) -> Any:
        begin = time.process_time()
        try:
            return inner(*arguments, **named)
        finally:
            spent[part] += time.process_time() - begin

    setattr(room, function, clocked)


def bare(name: str) -> float:
    """CPU seconds of one simulation of the scenario alone, the mean over its cases."""
    from thsa_cosim.system import open_plant, unpack

    spent = []
    for fmu, experiments, values in _experiments(name):
        with tempfile.TemporaryDirectory() as folder:
            unpack(fmu.path, Path(folder))
            with open_plant(fmu, Path(folder)) as plant:
                for experiment in experiments:
                    start = {**experiment.fixed, **values}
                    drive = (experiment.inputs, experiment.outputs, experiment.time)
                    plant.run(start, *drive, tolerance=experiment.tolerance)
                    begin = time.process_time()
                    for _ in range(5):
                        plant.run(start, *drive, tolerance=experiment.tolerance)
                    spent.append((time.process_time() - begin) / 5.0)
    return sum(spent) / len(spent)


def _experiments(name: str) -> Any:
    """(FMU, experiments, start values) of every point of the scenario."""
    from thsa_cosim.diagnosis.fitting.trials import trials_of
    from thsa_cosim.scenario import load
    from thsa_cosim.study import build_case
    from thsa_cosim.tune.problem import build_groups

    kind = command(name)
    if kind == "tune":
        tuned = load(SCENARIOS / f"{name}.toml")
        middle = tuned.parameters.assignments(tuned.before)
        yield tuned.fmu, [case.experiment for case in build_groups(tuned)[0].cases], middle
        return
    for scenario, points in _points(name):
        if kind == "diagnose":
            yield scenario.fmu, [trial.case.experiment("bare", None) for trial in trials_of(scenario)], {}
            continue
        for point in points:
            values = point.space.assignments(point.space.decode(_middle(point.space.dimension)))
            yield scenario.fmu, [case.experiment("bare", None) for case in point.cases], values
        for recording in () if points else scenario.validate:
            case = build_case(scenario, recording, scenario.fixed_for(recording.name))
            yield scenario.fmu, [case.experiment("bare", None)], {}


def _middle(dimension: int) -> Any:
    import numpy as np

    return np.full(dimension, 0.5)


def _points(name: str) -> Any:
    from thsa_cosim.identify.problem import build_point
    from thsa_cosim.scenario import StagedScenario, load

    files = {"fit": [EMPS], "validate": [EMPS]} if name == "emps" else {}
    study = load(SCENARIOS / f"{name}.toml", **files)
    parts = [s.scenario for s in study.stages] if isinstance(study, StagedScenario) else [study]
    for scenario in parts:
        searched = scenario.kind == "identify" and len(scenario.parameters)
        yield scenario, [build_point(scenario, p) for p in scenario.points] if searched else []


def task(name: str, count: int) -> list[dict[str, Any]]:
    """The first points of a scenario as plain arrays for the script."""
    import numpy as np

    found = []
    for _, points in _points(name):
        for point in points[:count]:
            space = point.space.parameters
            cases = []
            for case in point.cases:
                inputs = {n: case.inputs.resample(case.time)[n] for n in case.inputs.names}
                channels = {
                    c.name: (
                        np.searchsorted(case.time, c.time - 1e-9),
                        c.measured,
                        c.noise / np.sqrt(c.weight),
                    )
                    for c in case.channels
                }
                cases.append(
                    {
                        "fmu": str(case.fmu),
                        "fixed": dict(case.fixed),
                        "time": case.time,
                        "inputs": inputs,
                        "held": sorted(case.inputs.held),
                        "channels": channels,
                        "tolerance": case.tolerance,
                    }
                )
            found.append(
                {
                    "label": point.label,
                    "cases": cases,
                    "variables": [p.variable for p in space],
                    "lower": [p.lower for p in space],
                    "upper": [p.upper for p in space],
                    "log": [p.scale == "log" for p in space],
                    "factor": [p.to_variable(1.0) - p.to_variable(0.0) for p in space],
                    "offset": [p.to_variable(0.0) for p in space],
                }
            )
    return found


def measure(name: str, output: Path, script_points: int, start_s: float) -> None:
    """Print one line of the table, and the comparison with the script where there is one."""
    if name == "emps" and not EMPS.exists():
        print(f"{name:12s} left out: {EMPS} is not there")
        return
    folder = output / name
    begin = time.perf_counter()
    done = subprocess.run(
        [sys.executable, __file__, "--one", name, "--output", str(folder)],
        capture_output=True,
        text=True,
        check=False,
        env=_installed(),
    )
    wall = time.perf_counter() - begin
    said = " ".join(done.stderr.split())[-300:]
    if done.returncode or not done.stdout:
        print(f"{name:14s} failed: {said}", flush=True)
        return
    spent = json.loads(done.stdout.splitlines()[-1])
    if not spent["runs"] and (folder / "result.json").exists():
        print(f"{name:14s} left out: {folder} holds its result already; give another --output", flush=True)
        return
    if not (folder / "result.json").exists():
        print(f"{name:14s} left out, exit code {spent['code']}: {said}", flush=True)
        return
    result, each = json.loads((folder / "result.json").read_text()), bare(name)
    total = sum(spent[k] for k in ("import", "parent", "workers", "report", "export"))
    parts = "  ".join(f"{k} {spent[k]:.1f}" for k in ("import", "parent", "workers", "report", "export"))
    bare_s = spent["runs"] * each
    search = spent["parent"] + spent["workers"] - start_s
    print(
        f"{name:14s} {total:6.1f} s CPU, {wall:.0f} s wall, {spent['runs']} runs:  {parts}"
        f"  FMU {bare_s:.1f} ({1e3 * each:.2f} ms a run)  total/FMU {total / bare_s:.2f}"
        f"  search/FMU {search / bare_s:.2f}",
        flush=True,
    )
    if name in IDENTIFIED and script_points:
        _beside(name, result, total, script_points, output)
    if name in TUNED and script_points:
        _beside_tuning(name, result, total)


NUMPY, STUDY = "import numpy", "import numpy, scipy.optimize, fmpy, pandas"


def start_of(statement: str) -> float:
    """CPU seconds of an empty process that runs ``statement``: no worker starts for less than NUMPY."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", statement], check=True, env=_installed())
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _installed() -> dict[str, str]:
    """This environment, with bytecode: pip compiles it, and a development machine may have it turned off."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def _beside_tuning(name: str, result: dict[str, Any], total: float) -> None:
    """SciPy's evolution over the lean loop until it has our final cost."""
    path, cost = str(SCENARIOS / f"{name}.toml"), repr(result["after"]["cost"])
    done = subprocess.run(
        [sys.executable, str(HERE / "script_tuning.py"), path, cost],
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(done.stdout)
    above = found["cost"] / result["after"]["cost"] - 1.0
    print(
        f"{'':14s} the script: {found['cpu']:.1f} s CPU, {found['runs']} runs ({found['says']}); ours {total:.2f} s;"
        f"  script/ours {found['cpu'] / total:.1f}, cost {above:+.1e} above ours",
        flush=True,
    )


def _beside(name: str, result: dict[str, Any], total: float, count: int, output: Path) -> None:
    """The script on the first points of the same scenario, right after ours."""
    arrays = output / f"{name}.pickle"
    arrays.write_bytes(pickle.dumps(task(name, count)))
    script = [sys.executable, str(HERE / "script_least_squares.py"), str(arrays)]
    found = json.loads(subprocess.run(script, capture_output=True, text=True, check=True).stdout)
    ours = total / len(result["points"])
    theirs = found["cpu"] / len(found["points"])
    costs = {point["label"]: point for point in result["points"]}
    above = max(p["cost"] / costs[p["label"]]["cost"] - 1.0 for p in found["points"])
    runs = sum(p["runs"] for p in found["points"])
    apart = max(
        abs(value - own["value"]) / own["stderr"]
        for p in found["points"]
        for value, own in zip(p["values"], costs[p["label"]]["parameters"].values(), strict=True)
        if own["stderr"]
    )
    print(
        f"{'':12s} the script: {theirs:.1f} s CPU a temperature, {runs} runs; ours {ours:.2f} s;"
        f"  script/ours {theirs / ours:.1f}, cost {above:+.1e} above ours,"
        f" values {apart:.1e} standard errors apart"
    )


def main() -> None:
    """Parse the command line and measure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenarios", nargs="*", metavar="SCENARIO", help=", ".join(SHIPPED))
    parser.add_argument("--script-points", type=int, default=8)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print("\n" + json.dumps(one(options.one, options.output)))
        return
    import thsa_cosim

    compileall.compile_dir(str(Path(thsa_cosim.__file__).parent), quiet=2)
    start_s, floor_s = (min(start_of(statement) for _ in range(3)) for statement in (NUMPY, STUDY))
    print(f"floor: {floor_s:.2f} s for {STUDY!r}, {start_s:.2f} s for {NUMPY!r} in a worker")
    with tempfile.TemporaryDirectory() as folder:
        for name in options.scenarios or SHIPPED:
            measure(name, options.output or Path(folder), options.script_points, start_s)


if __name__ == "__main__":
    main()
