"""Every example of the Modelica Standard Library's packages for actuators: exported, simulated, compared.

    python benchmarks/modelica_corpus.py LIBRARY [--references FOLDER] [--earlier LIBRARY] [--only TEXT] [-o FILE.json]

LIBRARY is the folder that holds ``Modelica`` (or ``Modelica 4.1.0``), ``ModelicaServices`` and ``Complex.mo``; FOLDER a
checkout of modelica/MAP-LIB_ReferenceResults with ``<class as path>/<name>.csv`` and
``comparisonSignals.txt``. Nothing of either belongs to this repository. Each example is exported for this
machine, run by its own Co-Simulation over the time
of its reference, and judged "right", "WRONG", "runs" (no reference, or none of its signals is a variable of the FMU),
"refused" (with the reason), "fails" (no end of the simulation, with the first thing that the FMU says of it) or
"CRASH". An example may take MOST_SECONDS of CPU time, so that a busy machine does not change the table; what needs
more "fails" with the time that it has reached.

The references of a release may be older than the release: those of 4.1.0 were made with 4.0.0 (``creation.txt``).
``--earlier`` names the library that they were made with. What leaves the tube is exported from that one, too, and
judged "changed" where it is right there: the library has changed, not the exporter erred.

A signal is right where it lies within a tube around the reference: 2e-3 of its range in value (and 1e-6 of its largest
value), 2e-3 of the run in time. What lies outside is run again at a tighter tolerance before it is called wrong.
"""

import argparse
import collections
import csv
import json
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

PACKAGES = (
    "Modelica.Mechanics.Rotational.Examples",
    "Modelica.Mechanics.Translational.Examples",
    "Modelica.Electrical.Analog.Examples",
    "Modelica.Electrical.Machines.Examples.DCMachines",
    "Modelica.Electrical.Machines.Examples.SynchronousMachines",
    "Modelica.Blocks.Examples",
    "Modelica.Thermal.HeatTransfer.Examples",
)
SYNCHRONOUS = re.compile(r"SynchronousMachines\.SMPM")
TUBE = 2e-3
PRECISION = 1e-6  # of the largest value: the references are in single precision, made at a tolerance of 1e-6
MOST_SECONDS = 180  # of CPU time, for one example
MOST_WAITING = 3600  # s; only what hangs without using the CPU waits so long
DISCARD = 2  # fmi2Status: this and what is worse is said when a run ends


def examples(library: Path) -> list[str]:
    """Names of all examples: models of the packages that carry an ``experiment`` annotation."""
    from thsa_cosim.modelica.library import Library

    found: list[str] = []
    source = Library([library])

    def walk(name: str) -> None:
        definition = source.find(name)
        if definition is None:
            return
        if (
            definition.kind in ("model", "block")
            and definition.experiment
            and "partial" not in definition.prefixes
        ):
            found.append(name)
        if definition.kind == "package":
            for child in source.children(definition):
                walk(f"{name}.{child}")

    for package in PACKAGES:
        walk(package)
    return [n for n in found if "SynchronousMachines" not in n or SYNCHRONOUS.search(n)]


def reference(folder: Path | None, name: str) -> tuple[np.ndarray, dict[str, np.ndarray]] | None:
    """Times and signals of a reference, None where there is none."""
    if folder is None:
        return None
    place = folder.joinpath(*name.split("."))
    file = place / f"{name.rsplit('.', 1)[-1]}.csv"
    if not file.is_file():
        return None
    with file.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    names = [n.strip().strip('"') for n in rows[0]]
    values = np.array([[float(v) for v in row[: len(names)]] for row in rows[1:] if row and row[0]])
    wanted = place / "comparisonSignals.txt"
    chosen = set(names[1:])
    if wanted.is_file():
        chosen &= {line.strip() for line in wanted.read_text(encoding="utf-8").splitlines()}
    return values[:, 0], {n: values[:, k] for k, n in enumerate(names) if n in chosen and n != names[0]}


def in_tube(t: np.ndarray, y: np.ndarray, t_ref: np.ndarray, y_ref: np.ndarray) -> float:
    """How far y leaves the tube around the reference, in units of the tube's half width; at most 1 is right."""
    span = max(float(np.ptp(y_ref)), PRECISION / TUBE * float(np.max(np.abs(y_ref))), 1e-10)
    width = TUBE * float(t_ref[-1] - t_ref[0])
    step = np.diff(t_ref)
    slope = np.divide(np.diff(y_ref), step, out=np.zeros_like(step), where=step > 0.0)
    # between two samples it may go on as before the first, or come as after the second: a jump is not sampled
    before = y_ref[1:-1] + slope[:-1] * step[1:]
    after = y_ref[1:-1] - slope[1:] * step[:-1]
    least, most = y_ref.copy(), y_ref.copy()
    for values, at in ((before, slice(2, None)), (after, slice(None, -2))):
        least[at], most[at] = np.minimum(least[at], values), np.maximum(most[at], values)
    ends = [np.interp(t + s, t_ref, y_ref) for s in (-width, 0.0, width)]
    low, high = np.min(ends, axis=0), np.max(ends, axis=0)
    first, last = np.searchsorted(t_ref, t - width, "left"), np.searchsorted(t_ref, t + width, "right")
    for k in np.flatnonzero(last > first):
        low[k] = min(low[k], least[first[k] : last[k]].min())
        high[k] = max(high[k], most[first[k] : last[k]].max())
    inside = (t >= t_ref[0]) & (t <= t_ref[-1])
    outside = np.maximum(np.maximum(low - y, y - high), 0.0)[inside]
    return float(np.max(outside, initial=0.0)) / (TUBE * span)


class Stopped(Exception):
    """A run that does not reach its end, and why."""


def limit_cpu(seconds: int) -> None:
    """TimeoutError when this process has used so much CPU time; its end a little later, if it is in C all the time."""
    import resource

    def spent(*_: Any) -> None:
        raise TimeoutError(f"not done in {seconds} CPU s")

    signal.signal(signal.SIGXCPU, spent)
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 30))


def simulate(
    fmu: Path, t_ref: np.ndarray, names: list[str], tolerance: float = 1e-7
) -> dict[str, np.ndarray]:
    """One run over the reference's time, at 2,000 communication points; raises Stopped."""
    import fmpy

    span = float(t_ref[-1] - t_ref[0])
    said: list[str] = []
    reached = [float(t_ref[0])]

    def log(_environment: Any, _instance: Any, status: int, _category: Any, message: bytes) -> None:
        if status >= DISCARD:
            said.append(" ".join(message.decode(errors="replace").split()))

    def step_finished(time: float, _recorder: Any) -> bool:
        reached[0] = time
        return True

    try:
        result = fmpy.simulate_fmu(
            str(fmu), start_time=float(t_ref[0]), stop_time=float(t_ref[-1]), output_interval=span / 2000,
            output=names, record_events=False, relative_tolerance=tolerance, logger=log, step_finished=step_finished,
        )  # fmt: skip
    except TimeoutError as error:
        raise Stopped(f"{error}: at time {reached[0]:g} of {t_ref[-1]:g}") from error
    except Exception as error:
        raise Stopped((said or [" ".join(str(error).split())])[0]) from error
    return {n: np.asarray(result[n], dtype=float) for n in ("time", *names)}


def judge(
    name: str, library: Path, references: Path | None, scratch: Path, earlier: Path | None = None
) -> tuple[str, str]:
    """What becomes of one example; raises Stopped and, beyond its CPU time, TimeoutError."""
    import fmpy

    from thsa_cosim.errors import ThsaCosimError
    from thsa_cosim.export import export_fmu
    from thsa_cosim.export.compile import PLATFORMS

    fmu = scratch / "example.fmu"
    try:
        host = next(p.fmi2 for p in PLATFORMS if p.fmi2 and p.fmi2.startswith(fmpy.platform[:3]))
        export_fmu(name, package=library / "none", libraries=[library], output=fmu, platforms=[host])
    except ThsaCosimError as error:
        return "refused", str(error).replace(str(library), "")
    variables = {v.name for v in fmpy.read_model_description(str(fmu)).modelVariables}
    found = reference(references, name)
    experiment = fmpy.read_model_description(str(fmu)).defaultExperiment
    t_ref = np.array([0.0, float(experiment.stopTime)]) if found is None else found[0]
    signals = {} if found is None else {n: y for n, y in found[1].items() if n in variables}
    if not signals:
        simulate(fmu, t_ref, [])
        return "runs", "no reference" if found is None else "no signal of the reference is in the FMU"
    for tolerance in (1e-7, 1e-10):
        result = simulate(fmu, t_ref, list(signals), tolerance)
        worst = {n: in_tube(result["time"], result[n], t_ref, y) for n, y in signals.items()}
        if max(worst.values()) <= 1.0:
            break
    name_worst = max(worst, key=lambda n: worst[n])
    found_there = f"{worst[name_worst]:.3g} tube widths at {name_worst}"
    if worst[name_worst] <= 1.0:
        return "right", found_there
    if earlier is not None:
        what, why = judge(name, earlier, references, scratch)
        if what == "right":
            return "changed", f"{found_there}; with the library of the reference {why}"
    return "WRONG", found_there


def cpu_seconds() -> float:
    """CPU time of the processes that have ended so far."""
    import resource

    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def one(name: str, options: argparse.Namespace) -> tuple[str, str]:
    """The same in a process of its own."""
    command = [sys.executable, __file__, str(options.library), "--one", name]
    if options.references:
        command += ["--references", str(options.references)]
    if options.earlier:
        command += ["--earlier", str(options.earlier)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=MOST_WAITING)
    except subprocess.TimeoutExpired:
        return "fails", f"hangs for {MOST_WAITING} s"
    if done.returncode == -signal.SIGKILL:
        return "fails", f"not done in {MOST_SECONDS} CPU s, within one step"
    try:
        what, why = json.loads(done.stdout.strip().splitlines()[-1])
    except (ValueError, IndexError):
        return "CRASH", " ".join((done.stderr.strip().splitlines() or [str(done.returncode)])[-1].split())[
            :200
        ]
    return str(what), str(why)


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("library", type=Path)
    parser.add_argument("--references", type=Path)
    parser.add_argument("--earlier", type=Path, help="the library that the references were made with")
    parser.add_argument("--only", default="", help="examples whose name holds this text")
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        limit_cpu(MOST_SECONDS)
        with tempfile.TemporaryDirectory() as scratch:
            try:
                judged = judge(
                    options.one, options.library, options.references, Path(scratch), options.earlier
                )
            except (Stopped, TimeoutError) as error:
                judged = "fails", str(error)
            print(json.dumps(judged))
        return 0
    table = {}
    start, cpu = time.perf_counter(), cpu_seconds()
    for name in examples(options.library):
        if options.only not in name:
            continue
        table[name] = one(name, options)
        print(f"{table[name][0]:8s} {name.removeprefix('Modelica.'):75s} {table[name][1][:300]}", flush=True)
    count = collections.Counter(what for what, _ in table.values())
    print(", ".join(f"{n} {what}" for what, n in count.most_common()), f"of {len(table)}", end="; ")
    print(f"{time.perf_counter() - start:.0f} s, {cpu_seconds() - cpu:.0f} CPU s")
    if options.output:
        options.output.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    return int(count["WRONG"] + count["CRASH"] > 0)


if __name__ == "__main__":
    raise SystemExit(main())
