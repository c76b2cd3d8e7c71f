"""The worker process: runs jobs one after the other with one live FMU instance.

Started as ``python -c BOOT`` by ``process.WorkerProcess``. Orders come in on stdin, results go out on what
was stdout; file descriptors 1 and 2 are then pointed at the console file, so that nothing that native code
prints can get between the messages. It deletes nothing but what is in its own folder; when it loses its runner it
just ends, and its supervisor cleans up.
"""

import contextlib
import ctypes
import gc
import importlib
import io
import mmap
import os
import pickle
import queue
import shutil
import signal
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

import numpy as np

from thsa_cosim.batch.frames import (
    Done,
    MalformedMessage,
    Order,
    Ready,
    Recall,
    Returned,
    Setup,
    Stop,
    read_frame,
    write_frame,
)
from thsa_cosim.batch.job import Experiment
from thsa_cosim.batch.memory import ResidentMeter, limit_growth, no_core_files, private_bytes
from thsa_cosim.batch.outcome import Outcome, Status
from thsa_cosim.batch.surroundings import (
    Surroundings,
    descriptors_leak,
    open_descriptors,
    out_of_reach,
)
from thsa_cosim.errors import MachineError, ThsaCosimError
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.failure import SimulationFailure
from thsa_cosim.fmu.instance import Phase
from thsa_cosim.fmu.machine import is_machines, temporary_fault
from thsa_cosim.fmu.plant import Plant
from thsa_cosim.signals import Signals
from thsa_cosim.system import open_plant

PROGRESS_SLOTS = 8
SERIAL = 4
"""Slot of the progress block that holds the serial of the job in work, 0 between jobs."""
GROWTH = 5
"""Slot that holds by how many bytes the job in work has grown this process, if a limit is set."""
BEGAN = 6
"""Slot that holds when the job's FMU was first touched (time.monotonic, the same clock in all processes)."""

LOST = 83
"""Exit code of a worker that has lost the way to its runner."""
_COPIED = 32 * 2**20
"""An unpacked FMU up to this many bytes is copied for each worker, a larger one linked."""


class Worker:
    """Runs orders; ``serve`` is the main loop."""

    def __init__(self, setup: Setup, orders: int, results: int) -> None:
        self._setup = setup
        self._orders_pipe = orders
        self._results = results
        self._sending = threading.Lock()
        self._folder = Path(setup.folder)
        self._surroundings: Surroundings
        self._leaves = False
        self._cwd = Path(setup.folder) / "cwd"
        with (Path(setup.folder) / "progress").open("r+b") as file:
            self._map = mmap.mmap(file.fileno(), PROGRESS_SLOTS * 8)
        self._progress = np.frombuffer(self._map, dtype=np.float64)
        self._experiments: dict[int, tuple[Experiment, FmuDescription, str]] = {}
        self._plants: dict[str, Plant] = {}
        self._live: Plant | None = None
        self._orders: queue.SimpleQueue[Order | Stop] = queue.SimpleQueue()
        self._libc = None if os.name == "nt" else ctypes.CDLL(None)
        self._floor = 0
        self._meter = ResidentMeter()

    def listen(self, orders: BinaryIO) -> None:
        """Start the thread that reads orders ahead and notices when the parent dies."""

        def listen() -> None:
            with contextlib.suppress(MalformedMessage):  # the FMU has read from our pipe
                while (message := read_frame(orders)) is not None:
                    if isinstance(message, Stop):
                        self._orders.put(message)
                        return
                    if isinstance(message, Recall):
                        self._send(Returned(self._take_back()))
                    else:
                        for order in message:
                            self._orders.put(order)
            end()

        threading.Thread(target=listen, daemon=True).start()

    def _take_back(self) -> tuple[int, ...]:
        """Take the orders that are not begun out of the queue; only the listener puts anything in."""
        serials = []
        with contextlib.suppress(queue.Empty):
            while True:
                order = self._orders.get_nowait()
                assert isinstance(order, Order)
                serials.append(order.serial)
        return tuple(serials)

    def _send(self, message: Any) -> None:
        """Send from either thread."""
        try:
            with self._sending:
                write_frame(self._results, message)
        except OSError:
            end()

    def serve(self) -> None:
        """Run orders until told to stop."""
        if self._setup.memory_limit is not None and self._setup.backend != "python":
            with contextlib.suppress(Exception):  # what numba takes is none of the FMU's growth
                importlib.import_module("thsa_cosim.fmu.compiled")
        gc.freeze()  # what the imports have made lives as long as the process
        if self._setup.memory_limit is not None:
            self._floor = limit_growth(self._setup.memory_limit)
            threading.Thread(target=self._watch_memory, daemon=True).start()
        self._surroundings = Surroundings(self._folder, (self._results, self._orders_pipe))
        files = open_descriptors()
        self._send(Ready(self._meter.read(), os.getpid()))
        while not isinstance(order := self._orders.get(), Stop):
            self._progress[: BEGAN + 1] = (Phase.LOAD, np.nan, 0.0, 0.0, order.serial, 0.0, 0.0)
            outcome = self._run(order)
            is_dead = self._live is not None and self._live.is_dead
            leaves = is_dead or self._leaves or descriptors_leak(files)
            done = Done(order.serial, outcome, self._meter.read(), leaves)
            self._send(done)
            self._progress[SERIAL] = 0.0
            if leaves:
                return
        if self._live is not None:
            self._live.close()

    def _run(self, order: Order) -> Outcome:
        begin = time.perf_counter()
        signals: Signals | None = None
        reduced = None
        status, reason = Status.OK, ""
        try:
            self._surroundings.prepare()
            experiment, plant = self._experiment(order.experiment)
            # Deadlines count from here: reading recordings and importing reducers is not the FMU's fault.
            self._progress[BEGAN] = time.monotonic()
            values = {**experiment.fixed, **order.values}
            try:
                signals = _simulate(experiment, plant, values)
            finally:
                self._leaves = bool(self._surroundings.restore())
            if experiment.reduce is not None:
                self._progress[0] = Phase.REDUCE
                try:
                    reduced = np.atleast_1d(np.asarray(experiment.reduce(signals)))
                    if reduced.dtype != np.float32:
                        reduced = reduced.astype(np.float64, copy=False)
                except Exception as error:
                    ours = isinstance(error, OSError) and is_machines(error)
                    status = Status.MACHINE if ours else Status.COST_ERROR
                    reason = f"the cost raised {_sentence(error)}"
                if not order.keep_signals:
                    signals = None
        except SimulationFailure as failure:
            status, reason = failure.status, failure.reason
            self._leaves |= status is Status.CRASH  # what it has spoilt is not known
        except MemoryError:
            limited = self._setup.memory_limit is not None
            status, reason = Status.MEMORY if limited else Status.MACHINE, "memory ran out"
        except MachineError as error:
            status, reason = Status.MACHINE, str(error)
        except OSError as error:
            status, reason = Status.MACHINE, str(temporary_fault(error, Path(self._setup.root).parent))
        except ThsaCosimError as error:
            status, reason = Status.LOAD_ERROR, str(error).rstrip(".")
        except Exception as error:
            status, reason = Status.LOAD_ERROR, f"the run raised {_sentence(error)}"
        status, reason = self._memory_verdict(status, reason)
        return Outcome(status, reason, signals, reduced, time.perf_counter() - begin, self._console())

    def _experiment(self, index: int) -> tuple[Experiment, Plant]:
        if index not in self._experiments:
            with (Path(self._setup.root) / "experiments" / f"{index}.pickle").open("rb") as file:
                experiment, description, folder = pickle.load(file)
            own = own_copy(Path(folder), self._folder / "fmus")
            self._experiments[index] = experiment, description, str(own)
        experiment, description, folder = self._experiments[index]
        plant = self._plants.get(folder)
        if plant is not self._live and self._live is not None:
            self._live.close()  # one live instance per process
        if plant is None:
            setup: Any = self._setup
            plant = open_plant(
                description,
                Path(folder),
                kind=setup.kind,
                backend=setup.backend,
                reuse=setup.reuse,
                stepping=setup.stepping,
                progress=self._progress[:4],
                on_message=_to_stderr,
            )
            plant.warm_up()
            self._plants[folder] = plant
        self._live = plant
        plant.input_mode = experiment.input_mode
        plant.texts = experiment.texts
        return experiment, plant

    def _watch_memory(self) -> None:
        """Note the job's largest growth: when it dies of the limit, nobody can ask any more."""
        while True:
            growth = private_bytes() - self._floor
            self._progress[GROWTH] = max(self._progress[GROWTH], growth)
            time.sleep(0.002)

    def _memory_verdict(self, status: Status, reason: str) -> tuple[Status, str]:
        """Blame memory for a failure during which the process came near its limit."""
        limit = self._setup.memory_limit
        if limit is None or status in (Status.OK, Status.MEMORY) or self._progress[GROWTH] < 0.7 * limit:
            return status, reason
        return Status.MEMORY, f"the run outgrew {limit / 2**20:.0f} MiB and then failed: {reason}"

    def _console(self) -> str:
        """Return what was printed since the last run, cut; empty the console file and the scratch folder."""
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        if self._libc is not None:
            self._libc.fflush(None)
        for entry in os.scandir(self._cwd):
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            else:
                Path(entry.path).unlink(missing_ok=True)
        if os.fstat(1).st_size == 0:
            return ""
        text = read_console(Path(self._setup.folder), self._setup.console_limit)
        os.ftruncate(1, 0)
        return text


def read_console(folder: Path, limit: int) -> str:
    """Return the first ``limit`` bytes of a worker's console file."""
    with contextlib.suppress(OSError), (folder / "console").open("rb") as file:
        text = file.read(limit).decode("utf-8", "replace")
        more = os.fstat(file.fileno()).st_size - limit
        return text + (f"\n... ({more} bytes cut)" if more > 0 else "")
    return ""


def _simulate(experiment: Experiment, plant: Plant, values: Mapping[str, float]) -> Signals:
    """Run the FMU, inside its wrapper if it has one."""
    drive = (experiment.inputs, experiment.outputs, experiment.time)
    if experiment.wrapper is not None:
        return experiment.wrapper.run(plant.run, values, *drive, experiment.tolerance)
    return plant.run(values, *drive, tolerance=experiment.tolerance, most_steps=experiment.most_steps)


def _sentence(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:500]


def _to_stderr(line: str) -> None:
    os.write(2, line.encode("utf-8", "replace"))


def own_copy(folder: Path, parent: Path) -> Path:
    """Copy an unpacked FMU (or link it, if large) into ``parent``: it may delete or write its own files."""
    target = parent / folder.name
    if not target.exists():
        large = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file()) > _COPIED
        partial = parent / f"{folder.name}.part"
        shutil.rmtree(partial, ignore_errors=True)
        shutil.copytree(folder, partial, copy_function=_link if large else shutil.copyfile)
        partial.rename(target)
    return target


def _link(source: str, target: str) -> None:
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


def end() -> NoReturn:
    """End at once, whatever the FMU is doing: there is no runner any more, or no way to it."""
    os._exit(LOST)


def main(root: str) -> None:
    """Entry point of the process; ``root`` is the study's folder, for whoever looks at the process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    no_core_files()
    # The pipes move to other descriptors (not inherited by what an FMU starts); 0, 1, 2 become harmless.
    pipe, results = out_of_reach(os.dup(0)), out_of_reach(os.dup(1))
    orders = os.fdopen(pipe, "rb")
    setup = read_frame(orders)
    if not isinstance(setup, Setup):
        end()
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.close(null)
    os.dup2(2, 1)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(line_buffering=True, errors="replace")
    worker = Worker(setup, pipe, results)
    worker.listen(orders)
    if setup.main is not None:
        from multiprocessing import spawn

        spawn.prepare(setup.main)
    worker.serve()
    os._exit(0)  # native destructors and threads of an FMU could still crash or hang
